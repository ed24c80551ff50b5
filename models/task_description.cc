#include "models/task_description.h"

#include "base/errors.h"
#include "base/input_file.h"
#include "lcmtypes/metric_catalog.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// Returns the path of a file relative to the task's file or, if it does not exist there, relative to the
// folder of the shipped tasks. A copy of a shipped task therefore works in any folder.
std::filesystem::path FileIn(const YamlValue& value, const std::filesystem::path& folder, bool check_files) {
  if (IsAssetFile(value.Text())) return value.Text();
  const std::filesystem::path file = (folder / value.Text()).lexically_normal();
  if (!check_files || std::filesystem::is_regular_file(file)) return file;
  const std::filesystem::path shipped = (TasksFolder() / value.Text()).lexically_normal();
  if (!std::filesystem::is_regular_file(shipped)) {
    value.Fail("file " + file.string() + " does not exist" +
               (shipped == file ? "" : ", nor does " + shipped.string()));
  }
  return shipped;
}

std::vector<std::string> PartNamesOf(const TaskDescription& task) {
  std::vector<std::string> names;
  for (const ScenePart& part : task.parts) names.push_back(part.name);
  return names;
}

void ReadJoints(const YamlValue& value, std::vector<JointStart>* joints) {
  for (const YamlValue& entry : value.Entries()) {
    const auto [position, is_angle] =
        ReadJointPosition(YamlMap(entry, {}, {"position_deg", "position_rad", "position_m"}), "position");
    joints->push_back({entry.key(), is_angle, position, entry.location()});
  }
}

void ReadCameras(const YamlValue& value, std::vector<Camera>* cameras) {
  for (const YamlValue& entry : value.Entries()) {
    const YamlMap map(entry, {"position_m", "look_at_m", "vertical_fov_deg"});
    Camera camera;
    camera.name = entry.key();
    camera.position = map["position_m"].Vector<3>();
    camera.look_at = map["look_at_m"].Vector<3>();
    camera.vertical_fov = map["vertical_fov_deg"].Number({.min = 1, .max = 170});
    if (camera.position[0] == camera.look_at[0] && camera.position[1] == camera.look_at[1]) {
      map["look_at_m"].Fail("a camera cannot look straight up or down, or at itself");
    }
    cameras->push_back(std::move(camera));
  }
}

MetricsOptions ReadMetrics(const YamlValue& value) {
  MetricsOptions options;
  std::vector<std::string> known = {"slip_sample_window_ticks", "collision_sample_window_ticks"};
  for (const TrackOption& option : TrackOptions()) known.emplace_back(option.key);
  for (const YamlValue& entry : value.Entries()) {
    const auto option = std::ranges::find(TrackOptions(), entry.key(), &TrackOption::key);
    if (option != TrackOptions().end()) {
      if (!entry.Bool()) options.untracked.push_back(option->member);
    } else if (entry.key() == known[0]) {
      options.slip_sample_window = entry.Integer(1);
    } else if (entry.key() == known[1]) {
      options.collision_sample_window = entry.Integer(1);
    } else {
      entry.Fail("unknown key here" + Suggestion(entry.key(), known));
    }
  }
  return options;
}

// Appends a list of scene parts.
void ReadParts(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
               std::vector<ScenePart>* parts) {
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "model", "pose"}, {"free", "without", "sites", "may_penetrate"});
    ScenePart part;
    part.name = map["name"].Name();
    for (const ScenePart& other : *parts) {
      if (other.name == part.name) map["name"].Fail("another part has the name '" + part.name + "'");
    }
    if (part.name == "world") map["name"].Fail("'world' is reserved; choose another name");
    part.model_file = FileIn(map["model"], folder, check_files);
    part.pose = ReadPose(map["pose"]);
    if (const YamlValue* free = map.Find("free")) part.free = free->Bool();
    if (const YamlValue* without = map.Find("without")) part.without = without->Texts();
    if (const YamlValue* sites = map.Find("sites")) {
      for (const YamlValue& site : sites->Entries()) part.sites.push_back({site.key(), ReadPose(site)});
    }
    if (const YamlValue* allowed = map.Find("may_penetrate")) part.may_penetrate = allowed->Bool();
    part.location = entry.location();
    parts->push_back(std::move(part));
  }
}

void ReadScene(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
               TaskDescription* task) {
  const YamlMap map(value, {"base", "parts"}, {"cameras"});
  task->scene_file = FileIn(map["base"], folder, check_files);
  ReadParts(map["parts"], folder, check_files, &task->parts);
  if (const YamlValue* cameras = map.Find("cameras")) ReadCameras(*cameras, &task->cameras);
}

// Reads a list of parts; each entry is a name or {name, may_touch}.
void ReadObjects(const YamlValue& value, TaskDescription* task) {
  const std::vector<std::string> parts = PartNamesOf(*task);
  for (const YamlValue& entry : value.List()) {
    std::string name;
    if (entry.is_map()) {
      const YamlMap map(entry, {"name", "may_touch"});
      name = PartName(map["name"], parts);
      for (const YamlValue& allowed_contact : map["may_touch"].List())
        task->allowed_contacts.push_back({name, allowed_contact.Text(), allowed_contact.location()});
    } else {
      name = PartName(entry, parts);
    }
    if (std::ranges::find(task->objects, name) != task->objects.end())
      entry.Fail("'" + name + "' given twice");
    task->objects.push_back(name);
  }
}

std::vector<Stage> ReadStages(const YamlValue& value) {
  std::vector<Stage> stages;
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "when"});
    const std::string name = map["name"].Name();
    for (const Stage& other : stages) {
      if (other.name == name) map["name"].Fail("another stage has the name '" + name + "'");
    }
    stages.push_back({static_cast<int>(stages.size()) + 1, name, ReadExpression(map["when"])});
  }
  return stages;
}

// Marks the parts that a randomization places although they are not free.
void MarkPlaced(const Randomization& randomization, std::vector<ScenePart>* parts) {
  std::vector<std::string> objects;
  if (const auto* plane = std::get_if<SpawnPlane>(&randomization)) objects = plane->objects;
  if (const auto* box = std::get_if<SpawnBox>(&randomization)) objects = {box->object};
  if (const auto* yaw = std::get_if<SpawnYaw>(&randomization)) objects = {yaw->object};
  for (ScenePart& part : *parts) {
    if (!part.free && std::find(objects.begin(), objects.end(), part.name) != objects.end()) {
      part.placed = true;
    }
  }
}

void CheckFree(const Distractors& distractors, const std::vector<ScenePart>& parts) {
  for (const std::string& object : distractors.objects) {
    const auto part = std::ranges::find(parts, object, &ScenePart::name);
    if (part->free) continue;
    throw InputError(part->location.ToString() + ": part '" + object +
                     "' is a distractor of a variation, which requires 'free: true'");
  }
}

void ReadVariations(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
                    TaskDescription* task) {
  const auto num_common_parts = static_cast<std::ptrdiff_t>(task->parts.size());
  for (const YamlValue& entry : value.Entries()) {
    const YamlMap map(entry, {},
                      {"alias", "randomize", "robot_base", "parts", "poses", "joints", "cameras",
                       "instruction", "stages", "success", "failure", "target_distance"});
    Variation variation;
    variation.name = entry.KeyName();
    variation.location = entry.location();
    if (const YamlValue* alias = map.Find("alias")) {
      variation.alias = alias->Name();
      for (const Variation& other : task->variations) {
        if (variation.alias == other.alias)
          alias->Fail("variation '" + other.name + "' already has this alias");
        if (variation.alias == other.name || other.alias == variation.name)
          alias->Fail("variations '" + variation.name + "' and '" + other.name +
                      "': an alias of one is the name of the other");
      }
    }
    // While the variation's keys are read, its parts belong to the task, because these keys may name the
    // parts.
    if (const YamlValue* own = map.Find("parts")) ReadParts(*own, folder, check_files, &task->parts);
    const std::vector<std::string> parts = PartNamesOf(*task);
    if (const YamlValue* randomize = map.Find("randomize")) {
      static_cast<Randomized&>(variation) = ReadRandomized(*randomize, parts);
      for (const Randomization& randomization : variation.randomizations)
        MarkPlaced(randomization, &task->parts);
      for (const Distractors& distractors : variation.distractors) CheckFree(distractors, task->parts);
    }
    if (const YamlValue* base = map.Find("robot_base")) variation.robot_base = ReadPose(*base);
    if (const YamlValue* poses = map.Find("poses")) {
      for (const YamlValue& pose : poses->Entries()) {
        variation.poses[PartName(pose.key(), pose, parts)] = ReadPose(pose);
      }
    }
    if (const YamlValue* joints = map.Find("joints")) ReadJoints(*joints, &variation.joints);
    if (const YamlValue* cameras = map.Find("cameras")) ReadCameras(*cameras, &variation.cameras);
    if (const YamlValue* text = map.Find("instruction")) variation.instruction = text->Text();
    if (const YamlValue* stages = map.Find("stages")) variation.stages = ReadStages(*stages);
    if (const YamlValue* success = map.Find("success")) variation.success = ReadExpression(*success);
    if (const YamlValue* failure = map.Find("failure")) variation.failure = ReadExpression(*failure);
    if (const YamlValue* distance = map.Find("target_distance"))
      variation.target_distance = ReadNamedExpressions(*distance);
    variation.parts.assign(task->parts.begin() + num_common_parts, task->parts.end());
    task->parts.erase(task->parts.begin() + num_common_parts, task->parts.end());
    task->variations.push_back(std::move(variation));
  }
  if (task->variations.empty()) value.Fail("expected at least one variation, such as base: {}");
}

std::vector<std::string> VariationNames(const TaskDescription& task) {
  std::vector<std::string> names;
  for (const Variation& variation : task.variations) names.push_back(variation.name);
  return names;
}

}  // namespace

const Variation& TaskDescription::variation(const std::string& wanted) const {
  for (const Variation& candidate : variations) {
    if (candidate.name == wanted) return candidate;
  }
  throw InputError("task " + name + " has no variation '" + wanted + "'" +
                   Suggestion(wanted, VariationNames(*this)));
}

void TaskDescription::Apply(const std::string& wanted) {
  const Variation& chosen = variation(wanted);
  if (chosen.robot_base) robot_base = *chosen.robot_base;
  parts.insert(parts.end(), chosen.parts.begin(), chosen.parts.end());
  for (ScenePart& part : parts) {
    const auto pose = chosen.poses.find(part.name);
    if (pose != chosen.poses.end()) part.pose = pose->second;
  }
  // If names repeat, the first entry takes precedence.
  joints.insert(joints.begin(), chosen.joints.begin(), chosen.joints.end());
  cameras.insert(cameras.begin(), chosen.cameras.begin(), chosen.cameras.end());
  for (const AppearanceChange& change : chosen.appearance) {
    const auto* texture = std::get_if<RandomTexture>(&change);
    if (texture) textures.insert(textures.end(), texture->choices.begin(), texture->choices.end());
  }
  if (!chosen.instruction.empty()) instruction = chosen.instruction;
  if (chosen.stages) stages = *chosen.stages;
  if (!chosen.success.name.empty()) success = chosen.success;
  if (!chosen.failure.name.empty()) failure = chosen.failure;
  if (chosen.target_distance) target_distance = *chosen.target_distance;
}

void TaskDescription::ApplyRobot(const std::string& robot, const std::vector<std::string>& arms) {
  const auto found = std::ranges::find(other_robots, robot, &OtherRobot::name);
  const auto alike = std::ranges::find(other_robots, arms, &OtherRobot::arms);
  if (found != other_robots.end()) {
    target_distance = found->target_distance;
  } else if (alike != other_robots.end()) {
    target_distance = alike->target_distance;
  }
}

void TaskDescription::FindAssets(const ModelSources& sources) {
  for (ScenePart& part : parts) {
    const std::string model = part.model_file.string();
    if (IsAssetFile(model)) part.model_file = AssetFile(model, part.location, sources);
  }
}

TaskDescription ParseTask(const std::string& text, const std::filesystem::path& file, bool check_files) {
  const YamlMap map(ParseYaml(text, file.string()),
                    {"name", "title", "robot", "time_limit_s", "scene", "objects", "variations", "success"},
                    {"instruction", "joints", "stages", "metrics", "failure", "target_distance", "pose_error",
                     "other_robots"});
  TaskDescription task;
  // The path is empty for a task from a message; std::filesystem::absolute rejects an empty path.
  if (!file.empty()) task.file = std::filesystem::absolute(file).lexically_normal();
  task.text = text;
  const std::filesystem::path folder = task.file.parent_path();

  task.name = map["name"].Name();
  task.title = map["title"].Text();
  const YamlMap robot(map["robot"], {"file"}, {"base"});
  task.robot_file = FileIn(robot["file"], folder, check_files);
  if (const YamlValue* base = robot.Find("base")) task.robot_base = ReadPose(*base);
  task.time_limit = map["time_limit_s"].Number({.min = 0.001, .max = 1e6});
  ReadScene(map["scene"], folder, check_files, &task);
  ReadObjects(map["objects"], &task);
  if (const YamlValue* joints = map.Find("joints")) ReadJoints(*joints, &task.joints);
  if (const YamlValue* words = map.Find("instruction")) task.instruction = words->Text();
  ReadVariations(map["variations"], folder, check_files, &task);

  if (const YamlValue* metrics = map.Find("metrics")) task.metrics = ReadMetrics(*metrics);
  if (const YamlValue* stages = map.Find("stages")) task.stages = ReadStages(*stages);
  task.success = ReadExpression(map["success"]);
  if (const YamlValue* failure = map.Find("failure")) task.failure = ReadExpression(*failure);
  if (const YamlValue* distance = map.Find("target_distance"))
    task.target_distance = ReadNamedExpressions(*distance);
  if (const YamlValue* error = map.Find("pose_error")) task.pose_error = ReadNamedExpressions(*error);
  if (const YamlValue* others = map.Find("other_robots")) {
    for (const YamlValue& entry : others->Entries()) {
      const YamlMap other(entry, {"target_distance"}, {"arms"});
      task.other_robots.push_back({entry.key(),
                                   other.Find("arms") ? other["arms"].Texts() : std::vector<std::string>(),
                                   ReadNamedExpressions(other["target_distance"])});
    }
  }
  return task;
}

TaskDescription LoadTask(const std::filesystem::path& file) {
  return ParseTask(ReadInput(file, "task description"), file, true);
}

}  // namespace evalbus
