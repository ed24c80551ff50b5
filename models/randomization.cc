#include "models/randomization.h"

#include <algorithm>
#include <optional>

#include "models/farthest.h"

namespace evalbus {
namespace {

// Range of factors of masses and frictions, outside which the physics would not be meaningful. Its maximum
// also limits the brightness of lights.
constexpr NumberRange kFactor{.min = 1e-3, .max = 1e3};
// Range of rotations, in degrees.
constexpr NumberRange kTurn{.min = 0, .max = 180};
constexpr NumberRange kPosition{.min = -kFarthestPart, .max = kFarthestPart},
    kExtent{.min = 0, .max = kFarthestPart};

// Context for reading an entry of the list.
struct Context {
  const std::vector<std::string>& parts;
  Randomized* into;
};

std::vector<std::string> ReadPartNames(const YamlValue& value, const std::vector<std::string>& parts) {
  std::vector<std::string> names;
  for (const YamlValue& element : value.List()) {
    const std::string name = PartName(element, parts);
    if (std::find(names.begin(), names.end(), name) != names.end())
      element.Fail("'" + name + "' given twice");
    names.push_back(name);
  }
  return names;
}

NameInFile ReadName(const YamlValue& value) { return {value.Text(), value.location()}; }

std::vector<NameInFile> ReadNames(const YamlValue& value) {
  std::vector<NameInFile> names;
  for (const YamlValue& element : value.List()) names.push_back(ReadName(element));
  if (names.empty()) value.Fail("expected at least one part or body");
  return names;
}

Span ReadFactor(const YamlMap& map, NumberRange range) {
  const Span factor{map["min_factor"].Number(range), map["max_factor"].Number(range)};
  if (factor.min > factor.max) map["max_factor"].Fail("expected at least min_factor");
  return factor;
}

void ReadSpawnBox(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"object", "center_m", "half_extents_m"}, {"min_distance_m"});
  SpawnBox spawn;
  spawn.object = PartName(map["object"], context.parts);
  spawn.center = map["center_m"].Vector<2>(kPosition);
  spawn.half_extents = map["half_extents_m"].Vector<2>(kExtent);
  if (const YamlValue* distance = map.Find("min_distance_m"))
    spawn.min_distance = distance->Number(kNotNegative);
  context.into->randomizations.push_back(spawn);
}

void ReadSpawnPlane(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"objects", "origin_m", "half_extents_m", "spacing_m"}, {"jitter_m"});
  SpawnPlane spawn;
  spawn.location = value.location();
  spawn.objects = ReadPartNames(map["objects"], context.parts);
  spawn.origin = map["origin_m"].Vector<3>(kPosition);
  spawn.half_extents = map["half_extents_m"].Vector<2>(kExtent);
  spawn.spacing = map["spacing_m"].Number(kPositive);
  constexpr double kMaxPoints = 1000;  // along each side
  if (2 * std::max(spawn.half_extents[0], spawn.half_extents[1]) > kMaxPoints * spawn.spacing) {
    map["spacing_m"].Fail("expected a grid of at most 1000 by 1000 points");
  }
  if (const YamlValue* jitter = map.Find("jitter_m")) spawn.jitter = jitter->Vector<3>(kNotNegative);
  context.into->randomizations.push_back(spawn);
}

void ReadSpawnYaw(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"object"}, {"bound_deg", "bound_rad"});
  SpawnYaw spawn;
  spawn.object = PartName(map["object"], context.parts);
  const std::optional<double> bound = map.Angle("bound", {.min = 0, .max = 180});
  if (!bound) value.Fail("expected 'bound_deg' or 'bound_rad'");
  spawn.bound = *bound;
  context.into->randomizations.push_back(spawn);
}

void ReadSpawnJoint(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"joint"}, {"min_deg", "max_deg", "min_rad", "max_rad", "min_m", "max_m"});
  const JointPosition min = ReadJointPosition(map, "min"), max = ReadJointPosition(map, "max");
  if (min.is_angle != max.is_angle) value.Fail("expected both limits in m, or both as angles");
  if (min.position > max.position) value.Fail("expected a maximum that is at least the minimum");
  context.into->randomizations.push_back(
      SpawnJoint{map["joint"].Text(), min.is_angle, min.position, max.position, map["joint"].location()});
}

void ReadDistractors(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"objects", "center_m", "half_extents_m"}, {"min_count", "max_count"});
  Distractors distractors;
  distractors.objects = ReadPartNames(map["objects"], context.parts);
  distractors.center = map["center_m"].Vector<2>(kPosition);
  distractors.half_extents = map["half_extents_m"].Vector<2>(kExtent);
  const int number = static_cast<int>(distractors.objects.size());
  const YamlValue *min = map.Find("min_count"), *max = map.Find("max_count");
  distractors.min_count = min ? min->Integer(0, number) : 0;
  distractors.max_count = max ? max->Integer(distractors.min_count, number) : number;
  context.into->distractors.push_back(distractors);
}

void ReadMass(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"of", "min_factor", "max_factor"});
  context.into->physics.push_back(RandomMass{ReadNames(map["of"]), ReadFactor(map, kFactor)});
}

void ReadFriction(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"of", "min_factor", "max_factor"});
  context.into->physics.push_back(RandomFriction{ReadNames(map["of"]), ReadFactor(map, kFactor)});
}

void ReadSize(const YamlValue& value, const Context&) {
  value.Fail(
      "sizes cannot be randomized, because shapes and inertias are compiled into the model: give variations "
      "parts of different sizes");
}

void ReadColor(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"of", "min_rgb", "max_rgb"});
  constexpr NumberRange kFraction{.min = 0, .max = 1};
  const RandomColor color{ReadNames(map["of"]), map["min_rgb"].Vector<3>(kFraction),
                          map["max_rgb"].Vector<3>(kFraction)};
  for (size_t i = 0; i < 3; ++i) {
    if (color.min[i] > color.max[i]) map["max_rgb"].Fail("expected values of at least those of min_rgb");
  }
  context.into->appearance.push_back(color);
}

void ReadLight(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"name"}, {"min_factor", "max_factor", "shift_m", "turn_deg", "turn_rad"});
  RandomLight light{
      .name = ReadName(map["name"]), .factor = {}, .shift = {}, .turn = map.Angle("turn", kTurn)};
  const bool has_min = map.Find("min_factor") != nullptr, has_max = map.Find("max_factor") != nullptr;
  if (has_min != has_max) value.Fail("expected both min_factor and max_factor, or neither");
  if (has_min) light.factor = ReadFactor(map, {.min = 0, .max = kFactor.max});
  if (const YamlValue* shift = map.Find("shift_m")) light.shift = shift->Vector<3>(kNotNegative);
  if (!light.factor && !light.shift && !light.turn)
    value.Fail("expected min_factor and max_factor, shift_m, turn_deg or turn_rad");
  context.into->appearance.push_back(std::move(light));
}

void ReadTexture(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"of", "choices"});
  RandomTexture texture{ReadNames(map["of"]), {}};
  for (const YamlValue& element : map["choices"].List()) {
    const std::string name = element.Text();
    if (std::ranges::find(texture.choices, name, &NameInFile::text) != texture.choices.end())
      element.Fail("'" + name + "' given twice");
    texture.choices.push_back(ReadName(element));
  }
  if (texture.choices.size() < 2) map["choices"].Fail("expected at least two textures");
  context.into->appearance.push_back(std::move(texture));
}

void ReadCamera(const YamlValue& value, const Context& context) {
  const YamlMap map(value, {"name"}, {"shift_m", "turn_deg", "turn_rad"});
  RandomCamera camera;
  camera.name = ReadName(map["name"]);
  if (const YamlValue* shift = map.Find("shift_m")) camera.shift = shift->Vector<3>(kNotNegative);
  camera.turn = map.Angle("turn", kTurn).value_or(0);
  if (camera.turn == 0 && camera.shift == std::array<double, 3>{})
    value.Fail("expected shift_m, turn_deg or turn_rad above 0");
  context.into->appearance.push_back(camera);
}

struct Kind {
  const char* name;
  void (*read)(const YamlValue&, const Context&);
};
constexpr Kind kKinds[] = {{"spawn_box", ReadSpawnBox},
                           {"spawn_plane", ReadSpawnPlane},
                           {"spawn_yaw", ReadSpawnYaw},
                           {"spawn_joint", ReadSpawnJoint},
                           {"distractors", ReadDistractors},
                           {"mass", ReadMass},
                           {"friction", ReadFriction},
                           {"size", ReadSize},
                           {"color", ReadColor},
                           {"light", ReadLight},
                           {"texture", ReadTexture},
                           {"camera", ReadCamera}};

}  // namespace

std::string PartName(const std::string& name, const YamlValue& value, const std::vector<std::string>& parts) {
  if (std::find(parts.begin(), parts.end(), name) == parts.end())
    value.Fail("the scene has no part '" + name + "'" + Suggestion(name, parts));
  return name;
}

std::string PartName(const YamlValue& value, const std::vector<std::string>& parts) {
  return PartName(value.Text(), value, parts);
}

JointPosition ReadJointPosition(const YamlMap& map, const std::string& stem) {
  const std::optional<double> angle = map.Angle(stem);
  const YamlValue* length = map.Find(stem + "_m");
  if (angle.has_value() == (length != nullptr)) {
    map.value().Fail("expected one of " + stem + "_deg, " + stem + "_rad, " + stem + "_m");
  }
  return angle ? JointPosition{*angle, true} : JointPosition{length->Number(), false};
}

Randomized ReadRandomized(const YamlValue& value, const std::vector<std::string>& parts) {
  Randomized randomized;
  std::vector<const char*> names;
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {}, names);
    if (entry.Entries().size() != 1) entry.Fail("expected one kind of randomization, such as spawn_box");
    for (const Kind& kind : kKinds) {
      if (const YamlValue* body = map.Find(kind.name)) kind.read(*body, {parts, &randomized});
    }
  }
  return randomized;
}

}  // namespace evalbus
