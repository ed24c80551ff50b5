#include "models/force_limits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// The duration below which ISO/TS 15066:2016 calls a contact transient.
constexpr double kTransientTime = 0.5;

ForceLimit ParseForceLimit(const YamlValue& value) {
  constexpr const char *kQuasiStatic = "quasi_static_force_N", *kTransient = "transient_force_N",
                       *kTime = "transient_s", *kGrip = "grip_force_N";
  const YamlMap map(value, {"bodies"}, {kQuasiStatic, kTransient, kTime, kGrip});
  const auto force = [&map](const char* key) {
    const YamlValue* given = map.Find(key);
    return given ? given->Number(kPositive) : std::numeric_limits<double>::infinity();
  };
  if (!map.Find(kGrip) || map.Find(kQuasiStatic) || map.Find(kTransient) || map.Find(kTime)) {
    // The limits of contacts must be given together. Throws an error that names the missing one.
    YamlMap(value, {"bodies", kQuasiStatic, kTransient}, {kTime, kGrip});
  }
  ForceLimit limit{.region = value.key(),
                   .bodies = map["bodies"].Texts(),
                   .quasi_static_force = force(kQuasiStatic),
                   .transient_force = force(kTransient),
                   .grip_force = force(kGrip),
                   .transient_time = kTransientTime};
  if (limit.bodies.empty()) map["bodies"].Fail("expected at least one body");
  for (const YamlValue& body : map["bodies"].List()) limit.locations.push_back(body.location());
  if (limit.transient_force < limit.quasi_static_force) {
    map[kTransient].Fail("expected at least quasi_static_force_N");
  }
  if (const YamlValue* time = map.Find(kTime)) limit.transient_time = time->Number(kNotNegative);
  return limit;
}

}  // namespace

std::vector<ForceLimit> ParseForceLimits(const std::string& text, const std::string& file) {
  const YamlValue regions = YamlMap(ParseYaml(text, file), {"limits"})["limits"];
  std::vector<ForceLimit> limits;
  for (const YamlValue& region : regions.Entries()) limits.push_back(ParseForceLimit(region));
  if (limits.empty()) regions.Fail("expected at least one region");
  return limits;
}

std::vector<uint8_t> BodiesOf(const ForceLimit& limit, const ModelNames& names) {
  const model_info_t& model = names.model();
  std::vector<uint8_t> is_concerned(static_cast<size_t>(model.num_bodies));
  for (size_t k = 0; k < limit.bodies.size(); ++k) {
    const std::vector<uint8_t> bodies = names.Bodies(limit.bodies[k], limit.locations[k]);
    for (size_t body = 0; body < bodies.size(); ++body) {
      if (!bodies[body]) continue;
      is_concerned[body] = 1;
      const bool is_object =
          std::ranges::find(model.object_entity, model.body_entity[body]) != model.object_entity.end();
      if (is_object || std::isinf(limit.grip_force)) continue;
      throw InputError(fmt::format(
          "{}: '{}' in a region with grip_force_N: expected a manipulated object ({}) or one of its bodies",
          limit.locations[k].ToString(), limit.bodies[k], fmt::join(model.object_name, ", ")));
    }
  }
  if (std::ranges::none_of(model.geom_body, [&](int body) { return is_concerned[body] != 0; })) {
    throw InputError(fmt::format("{}: no body of region '{}' has a geom that collides, so nothing touches it",
                                 limit.locations[0].ToString(), limit.region));
  }
  return is_concerned;
}

}  // namespace evalbus
