#include "models/task_description.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>

#include "base/errors.h"
#include "lcmtypes/metric_catalogue.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

std::filesystem::path FileIn(const YamlValue& value, const std::filesystem::path& folder, bool check_files) {
  const std::filesystem::path file = (folder / value.Text()).lexically_normal();
  if (check_files && !std::filesystem::is_regular_file(file))
    value.Fail("file " + file.string() + " does not exist");
  return file;
}

// The name, which `value` contains, if it is that of a part.
std::string PartName(const std::string& name, const YamlValue& value, const TaskDescription& task) {
  std::vector<std::string> names;
  for (const ScenePart& part : task.parts) names.push_back(part.name);
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    value.Fail("no part of the scene is called '" + name + "'" + Suggestion(name, names));
  }
  return name;
}

std::string PartName(const YamlValue& value, const TaskDescription& task) {
  return PartName(value.Text(), value, task);
}

std::vector<std::string> PartNames(const YamlValue& value, const TaskDescription& task) {
  std::vector<std::string> names;
  for (const YamlValue& element : value.List()) {
    const std::string name = PartName(element, task);
    if (std::find(names.begin(), names.end(), name) != names.end())
      element.Fail("'" + name + "' given twice");
    names.push_back(name);
  }
  return names;
}

Randomisation ReadRandomisation(const YamlValue& value, const TaskDescription& task) {
  const YamlMap kind(value, {}, {"spawn_box", "spawn_plane", "spawn_yaw"});
  if (value.Entries().size() != 1) value.Fail("expected one of spawn_box, spawn_plane, spawn_yaw");
  if (const YamlValue* box = kind.Find("spawn_box")) {
    const YamlMap map(*box, {"object", "center_m", "half_extents_m"}, {"min_distance_m"});
    SpawnBox spawn;
    spawn.object = PartName(map["object"], task);
    spawn.center = map["center_m"].Vector<2>();
    spawn.half_extents = map["half_extents_m"].Vector<2>(kNotNegative);
    if (const YamlValue* distance = map.Find("min_distance_m"))
      spawn.min_distance = distance->Number(kNotNegative);
    return spawn;
  }
  if (const YamlValue* plane = kind.Find("spawn_plane")) {
    const YamlMap map(*plane, {"objects", "origin_m", "half_extents_m", "spacing_m"}, {"jitter_m"});
    SpawnPlane spawn;
    spawn.objects = PartNames(map["objects"], task);
    spawn.origin = map["origin_m"].Vector<3>();
    spawn.half_extents = map["half_extents_m"].Vector<2>(kNotNegative);
    spawn.spacing = map["spacing_m"].Number(kPositive);
    constexpr double kMaxPoints = 1000;  // along each side
    if (2 * std::max(spawn.half_extents[0], spawn.half_extents[1]) > kMaxPoints * spawn.spacing) {
      map["spacing_m"].Fail("expected a grid of at most 1000 by 1000 points");
    }
    if (const YamlValue* jitter = map.Find("jitter_m")) spawn.jitter = jitter->Vector<3>(kNotNegative);
    return spawn;
  }
  const YamlValue& yaw = *kind.Find("spawn_yaw");
  const YamlMap map(yaw, {"object"}, {"bound_deg", "bound_rad"});
  SpawnYaw spawn;
  spawn.object = PartName(map["object"], task);
  const std::optional<double> bound = map.Angle("bound", {.min = 0, .max = 180});
  if (!bound) yaw.Fail("expected 'bound_deg' or 'bound_rad'");
  spawn.bound = *bound;
  return spawn;
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
      entry.Fail("not a key here" + Suggestion(entry.key(), known));
    }
  }
  return options;
}

// Appends a list of parts.
void ReadParts(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
               std::vector<ScenePart>* parts) {
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "model", "pose"}, {"free"});
    ScenePart part;
    part.name = map["name"].Name();
    for (const ScenePart& other : *parts) {
      if (other.name == part.name) map["name"].Fail("another part is called '" + part.name + "'");
    }
    if (part.name == "world") map["name"].Fail("'world' is the world itself; choose another name");
    part.model_file = FileIn(map["model"], folder, check_files);
    part.pose = ReadPose(map["pose"]);
    if (const YamlValue* free = map.Find("free")) part.free = free->Bool();
    part.location = entry.location();
    parts->push_back(std::move(part));
  }
}

void ReadScene(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
               TaskDescription* task) {
  const YamlMap map(value, {"base", "parts"});
  task->scene_file = FileIn(map["base"], folder, check_files);
  ReadParts(map["parts"], folder, check_files, &task->parts);
}

std::vector<Stage> ReadStages(const YamlValue& value) {
  std::vector<Stage> stages;
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "when"});
    const std::string name = map["name"].Name();
    for (const Stage& other : stages) {
      if (other.name == name) map["name"].Fail("another stage is called '" + name + "'");
    }
    stages.push_back({static_cast<int>(stages.size()) + 1, name, ReadExpression(map["when"])});
  }
  return stages;
}

// Marks the parts that a randomisation places although they are not free.
void MarkPlaced(const Randomisation& randomisation, std::vector<ScenePart>* parts) {
  std::vector<std::string> objects;
  if (const auto* plane = std::get_if<SpawnPlane>(&randomisation)) objects = plane->objects;
  if (const auto* box = std::get_if<SpawnBox>(&randomisation)) objects = {box->object};
  if (const auto* yaw = std::get_if<SpawnYaw>(&randomisation)) objects = {yaw->object};
  for (ScenePart& part : *parts) {
    if (!part.free && std::find(objects.begin(), objects.end(), part.name) != objects.end()) {
      part.placed = true;
    }
  }
}

void ReadVariations(const YamlValue& value, const std::filesystem::path& folder, bool check_files,
                    TaskDescription* task) {
  const auto num_common_parts = static_cast<std::ptrdiff_t>(task->parts.size());
  for (const YamlValue& entry : value.Entries()) {
    const YamlMap map(entry, {},
                      {"alias", "randomise", "robot_base", "parts", "poses", "stages", "success", "failure"});
    Variation variation;
    variation.name = entry.key();
    if (const YamlValue* alias = map.Find("alias")) variation.alias = alias->Name();
    // The variation's own parts are the task's while its keys are read, for these name parts.
    if (const YamlValue* parts = map.Find("parts")) ReadParts(*parts, folder, check_files, &task->parts);
    if (const YamlValue* randomise = map.Find("randomise")) {
      for (const YamlValue& element : randomise->List()) {
        variation.randomisations.push_back(ReadRandomisation(element, *task));
        MarkPlaced(variation.randomisations.back(), &task->parts);
      }
    }
    if (const YamlValue* base = map.Find("robot_base")) variation.robot_base = ReadPose(*base);
    if (const YamlValue* poses = map.Find("poses")) {
      for (const YamlValue& pose : poses->Entries()) {
        variation.poses[PartName(pose.key(), pose, *task)] = ReadPose(pose);
      }
    }
    if (const YamlValue* stages = map.Find("stages")) variation.stages = ReadStages(*stages);
    if (const YamlValue* success = map.Find("success")) variation.success = ReadExpression(*success);
    if (const YamlValue* failure = map.Find("failure")) variation.failure = ReadExpression(*failure);
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
  if (!chosen.stages.empty()) stages = chosen.stages;
  if (!chosen.success.name.empty()) success = chosen.success;
  if (!chosen.failure.name.empty()) failure = chosen.failure;
}

void TaskDescription::ApplyRobot(const std::string& robot) {
  for (const OtherRobot& other : other_robots) {
    if (other.name == robot) target_distance = other.target_distance;
  }
}

TaskDescription ParseTask(const std::string& text, const std::filesystem::path& file, bool check_files) {
  const YamlMap map(
      ParseYaml(text, file.string()),
      {"name", "title", "robot", "time_limit_s", "scene", "objects", "variations", "stages", "success"},
      {"metrics", "failure", "target_distance", "pose_error", "other_robots"});
  TaskDescription task;
  // Of a message it may be empty, which has no absolute path.
  if (!file.empty()) task.file = std::filesystem::absolute(file).lexically_normal();
  task.text = text;
  const std::filesystem::path folder = task.file.parent_path();

  task.name = map["name"].Name();
  task.title = map["title"].Text();
  const YamlMap robot(map["robot"], {"file"}, {"base"});
  task.robot_file = FileIn(robot["file"], folder, check_files);
  if (const YamlValue* base = robot.Find("base")) task.robot_base = ReadPose(*base);
  task.time_limit = map["time_limit_s"].Number(kPositive);
  ReadScene(map["scene"], folder, check_files, &task);
  task.objects = PartNames(map["objects"], task);
  ReadVariations(map["variations"], folder, check_files, &task);

  if (const YamlValue* metrics = map.Find("metrics")) task.metrics = ReadMetrics(*metrics);
  task.stages = ReadStages(map["stages"]);
  task.success = ReadExpression(map["success"]);
  if (const YamlValue* failure = map.Find("failure")) task.failure = ReadExpression(*failure);
  if (const YamlValue* distance = map.Find("target_distance"))
    task.target_distance = ReadNamedExpressions(*distance);
  if (const YamlValue* error = map.Find("pose_error")) task.pose_error = ReadNamedExpressions(*error);
  if (const YamlValue* others = map.Find("other_robots")) {
    for (const YamlValue& entry : others->Entries()) {
      const YamlMap other(entry, {"target_distance"});
      task.other_robots.push_back({entry.key(), ReadNamedExpressions(other["target_distance"])});
    }
  }
  return task;
}

TaskDescription LoadTask(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  if (!stream || std::filesystem::is_directory(file)) {
    throw InputError(file.string() + ": cannot read the task description");
  }
  return ParseTask(text.str(), file, true);
}

}  // namespace evalbus
