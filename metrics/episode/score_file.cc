#include "metrics/episode/score_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/episode/result_json.h"
#include "metrics/episode/rollout_metrics.h"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::metrics {
namespace {

using nlohmann::json;

// A value in the document together with its path ("steps[3].left.joint_position"). The path is derived from
// the parent Node, which must outlive this one.
class Node {
 public:
  // Creates the root node of a document, or of a value in it whose path is given.
  Node(const json* value, const std::string* file, std::string path = "")
      : value_(value), file_(file), path_(std::move(path)) {}

  [[noreturn]] void Fail(const std::string& expected) const {
    std::string got = value_->dump(-1, ' ', false, json::error_handler_t::replace);
    if (got.size() > 40) got = got.substr(0, 37) + "...";
    const std::string path = Path();
    throw InputError(*file_ + ": " + (path.empty() ? "the document" : path) + ": expected " + expected +
                     ", got " + got);
  }

  // Requires an object with exactly the `required` keys; `optional` ones may be present.
  void CheckKeys(const std::vector<std::string>& required,
                 std::initializer_list<const char*> optional = {}) const {
    if (!value_->is_object()) Fail("an object");
    for (const std::string& key : required) {
      if (!value_->contains(key)) throw InputError(*file_ + ": " + Child(key) + ": required key is missing");
    }
    for (const auto& item : value_->items()) {
      const std::string& key = item.key();
      const auto same = [&](std::string_view known) { return known == key; };
      if (std::none_of(required.begin(), required.end(), same) &&
          std::none_of(optional.begin(), optional.end(), same)) {
        throw InputError(*file_ + ": " + Child(key) + ": unknown key; expected only " +
                         Join(required, optional));
      }
    }
  }

  Node operator[](const std::string& key) const {
    const auto found = value_->find(key);
    return {this, &*found, &found.key(), 0};
  }
  Node operator[](size_t index) const { return {this, &(*value_)[index], nullptr, index}; }

  size_t ArraySize() const {
    if (!value_->is_array()) Fail("an array");
    return value_->size();
  }
  bool Bool() const {
    if (!value_->is_boolean()) Fail("true or false");
    return value_->get<bool>();
  }
  int Integer(int lowest, int highest) const {
    // The range is checked as double, because an unsigned value beyond int64 would wrap into the range.
    if (!value_->is_number_integer() || value_->get<double>() < lowest || value_->get<double>() > highest) {
      Fail("an integer from " + std::to_string(lowest) + " to " + std::to_string(highest));
    }
    return value_->get<int>();
  }
  double Number() const {
    if (!value_->is_number() || !std::isfinite(value_->get<double>())) Fail("a finite number");
    return value_->get<double>();
  }
  double PositiveNumber() const {
    if (!value_->is_number() || !(value_->get<double>() > 0) || !std::isfinite(value_->get<double>())) {
      Fail("a number above 0");
    }
    return value_->get<double>();
  }
  std::string Name() const {
    if (!value_->is_string() || value_->get_ref<const std::string&>().empty()) Fail("a name");
    return value_->get<std::string>();
  }
  // Requires exactly out.size() numbers.
  void Numbers(std::span<double> out) const {
    if (!value_->is_array() || value_->size() != out.size()) {
      Fail(std::to_string(out.size()) + " numbers" +
           (value_->is_array() ? " (this array has " + std::to_string(value_->size()) + ")" : ""));
    }
    for (size_t k = 0; k < out.size(); ++k) out[k] = (*this)[k].Number();
  }
  const json& value() const { return *value_; }

 private:
  Node(const Node* parent, const json* value, const std::string* key, size_t index)
      : value_(value), file_(parent->file_), parent_(parent), key_(key), index_(index) {}
  std::string Path() const {
    if (!parent_) return path_;
    return key_ ? parent_->Child(*key_) : parent_->Path() + "[" + std::to_string(index_) + "]";
  }
  std::string Child(const std::string& key) const {
    const std::string path = Path();
    return path.empty() ? key : path + "." + key;
  }
  static std::string Join(const std::vector<std::string>& required,
                          std::initializer_list<const char*> optional) {
    std::string text;
    for (const std::string& key : required) text += (text.empty() ? "" : ", ") + key;
    for (const char* key : optional) text += std::string(text.empty() ? "" : ", ") + key;
    return text.empty() ? "nothing" : text;
  }
  const json* value_;
  const std::string* file_;
  std::string path_;
  const Node* parent_ = nullptr;
  // Key in the parent, or null if the parent is an array; then index_ is the index.
  const std::string* key_ = nullptr;
  size_t index_ = 0;
};

std::vector<ArmConfig> ReadArms(const Node& robot) {
  robot.CheckKeys({"arms", "dof"});
  const json& names = robot["arms"].value();
  if (names != json::array({"left", "right"}) && names != json::array({"left"}) &&
      names != json::array({"right"})) {
    robot["arms"].Fail(R"(["left", "right"], ["left"] or ["right"])");
  }
  const int dof = robot["dof"].Integer(1, 1000);
  std::vector<ArmConfig> arms;
  for (const json& name : names) {
    ArmConfig& arm = arms.emplace_back();
    arm.name = name.get<std::string>();
    arm.num_joints = dof;
  }
  return arms;
}

// robot, scene and ignored must be disjoint and together contain every geom id.
std::vector<GeomOwner> ReadGeoms(const Node& geoms) {
  geoms.CheckKeys({"count", "robot", "scene", "ignored"}, {"arms", "objects", "names"});
  const int count = geoms["count"].Integer(0, 10'000'000);
  std::vector<GeomOwner> owner(count);
  std::vector<bool> seen(count);
  const std::pair<const char*, GeomOwner> lists[] = {
      {"robot", GeomOwner::kRobot}, {"scene", GeomOwner::kScene}, {"ignored", GeomOwner::kObject}};
  for (const auto& [key, kind] : lists) {
    const Node list = geoms[key];
    for (size_t k = 0; k < list.ArraySize(); ++k) {
      const int id = list[k].Integer(0, count - 1);
      if (seen[id]) list[k].Fail("each id once, in one of robot, scene and ignored");
      seen[id] = true;
      owner[id] = kind;
    }
  }
  const auto missing = std::find(seen.begin(), seen.end(), false);
  if (missing != seen.end()) {
    geoms["count"].Fail("each id below the count in one of robot, scene and ignored (" +
                        std::to_string(missing - seen.begin()) + " is missing)");
  }
  return owner;
}

MetricsConfig ReadConfig(const Node& episode, const ScoreOptions& options) {
  MetricsConfig config;
  config.arms = ReadArms(episode["robot"]);
  for (const ArmConfig& arm : config.arms) config.grippers.push_back(arm.name);
  config.control_dt = episode["control_dt"].PositiveNumber();
  episode["control_frequency"].PositiveNumber();

  const Node node = episode["config"];
  std::vector<std::string> keys = {"slip_sample_window", "slip_objects"};
  for (const TrackOption& option : TrackOptions()) keys.emplace_back(option.key);
  node.CheckKeys(keys);
  for (const TrackOption& option : TrackOptions()) {
    if (!node[std::string(option.key)].Bool()) config.untracked.push_back(option.member);
  }
  config.slip_sample_window = node["slip_sample_window"].Integer(1, 1'000'000'000);
  config.collision_sample_window =
      options.collision_sample_window == 0 ? config.slip_sample_window : options.collision_sample_window;
  const Node objects = node["slip_objects"];
  for (size_t k = 0; k < objects.ArraySize(); ++k) {
    const Node name = objects[k];
    config.objects.push_back(name.Name());
    if (std::count(config.objects.begin(), config.objects.end(), config.objects.back()) > 1) {
      name.Fail("each object once");
    }
  }
  config.geom_owner = ReadGeoms(episode["geoms"]);
  config.extended = false;
  return config;
}

// Reads a value of "finalize": null, a number, or an object of names and numbers.
void ReadFinal(const Node& value, std::vector<std::string>* names, std::vector<double>* numbers) {
  if (value.value().is_number()) {
    names->emplace_back();
    numbers->push_back(value.Number());
  } else if (value.value().is_object()) {
    for (const auto& [name, unused] : value.value().items()) {
      if (name.empty()) value.Fail("names that are not empty");
      names->push_back(name);
      numbers->push_back(value[name].Number());
    }
  } else if (!value.value().is_null()) {
    value.Fail("null, a number, or an object of names and numbers");
  }
}

constexpr int kMaxGeom = std::numeric_limits<int>::max();

// One step of the trajectory. It owns the memory that its Sample points into.
class Step {
 public:
  explicit Step(const MetricsConfig& config)
      : config_(config),
        keys_{"t", "contacts"},
        opening_(config.grippers.size()),
        holding_(config.objects.size() * config.grippers.size()) {
    for (const ArmConfig& arm : config.arms) {
      const size_t dof = arm.num_joints;
      keys_.push_back(arm.name);
      const std::vector<double>& joints = joints_.emplace_back(2 * dof);
      arm_.push_back({.joint_position = {joints.data(), dof}, .joint_velocity = {joints.data() + dof, dof}});
    }
  }

  // Reads the gripper opening and holding flags of an arm, in the initial state and in each step.
  void ReadGripper(const Node& arm, size_t k) {
    opening_[k] = arm["gripper_opening"].Number();
    arm["holding"].CheckKeys(config_.objects);
    for (size_t object = 0; object < config_.objects.size(); ++object) {
      Holding(object, k) = arm["holding"][config_.objects[object]].Bool();
    }
  }

  void Read(const Node& node, int64_t index) {
    node.CheckKeys(keys_);
    time_ = node["t"].Number();
    if (!InTime(index)) {
      node["t"].Fail("(index + 1) * control_dt = " + json(ExpectedTime(index)).dump());
    }
    for (size_t k = 0; k < arm_.size(); ++k) {
      const Node arm = node[config_.arms[k].name];
      arm.CheckKeys(arm_keys_);
      arm["joint_position"].Numbers(Positions(k));
      arm["joint_velocity"].Numbers(Velocities(k));
      arm["wrist_position"].Numbers(arm_[k].wrist_position);
      arm["wrist_quaternion"].Numbers(arm_[k].wrist_quat);
      if (!IsUnit(arm_[k].wrist_quat)) arm["wrist_quaternion"].Fail("[w, x, y, z] of norm 1");
      ReadGripper(arm, k);
    }
    contacts_.clear();
    const Node contacts = node["contacts"];
    for (size_t k = 0; k < contacts.ArraySize(); ++k) {
      const Node contact = contacts[k];
      if (contact.ArraySize() != 3) contact.Fail("[geom_a, geom_b, dist]");
      contacts_.push_back({contact[0].Integer(-kMaxGeom, kMaxGeom), contact[1].Integer(-kMaxGeom, kMaxGeom),
                           contact[2].Number()});
    }
  }

  Sample AsSample(int64_t index) const {
    return {.tick = index + 1,
            .time = time_,
            .arm = arm_,
            .gripper_opening = opening_,
            .holding = holding_,
            .contacts = contacts_};
  }
  const std::vector<double>& opening() const { return opening_; }
  const std::vector<uint8_t>& holding() const { return holding_; }

 private:
  static bool IsUnit(const std::array<double, 4>& q) { return std::abs(SampleDeriver::Norm(q) - 1) <= 0.01; }
  double ExpectedTime(int64_t index) const { return static_cast<double>(index + 1) * config_.control_dt; }
  bool InTime(int64_t index) const {
    return !(std::abs(time_ - ExpectedTime(index)) > 0.01 * config_.control_dt);
  }
  std::span<double> Positions(size_t k) { return std::span(joints_[k]).first(joints_[k].size() / 2); }
  std::span<double> Velocities(size_t k) { return std::span(joints_[k]).last(joints_[k].size() / 2); }
  uint8_t& Holding(size_t object, size_t k) { return holding_[object * opening_.size() + k]; }

  const MetricsConfig& config_;
  std::vector<std::string> keys_;
  std::vector<std::string> arm_keys_ = {"joint_position",   "joint_velocity",  "wrist_position",
                                        "wrist_quaternion", "gripper_opening", "holding"};
  double time_ = 0;
  std::vector<std::vector<double>> joints_;  // of each arm: positions, then velocities
  std::vector<ArmSample> arm_;
  std::vector<double> opening_;
  std::vector<uint8_t> holding_;
  std::vector<GeomContact> contacts_;
};

constexpr const char* kNeeded[] = {"robot", "control_frequency", "control_dt", "config", "geoms", "initial"};

// An episode whose steps are read one at a time.
class Trajectory {
 public:
  Trajectory(std::string file, const ScoreOptions& options) : file_(std::move(file)), options_(options) {
    if (options.collision_sample_window < 0) {
      throw InputError("collision_sample_window: expected 0 or more, got " +
                       std::to_string(options.collision_sample_window));
    }
  }

  // Adds the next step. Returns false if the document read so far lacks the keys that are needed to interpret
  // steps.
  bool Take(const json& document, const json& step) {
    if (!metrics_) {
      for (const char* key : kNeeded) {
        if (!document.contains(key)) return false;
      }
      Begin(Node(&document, &file_));
    }
    Add(step);
    return true;
  }

  // Returns the result, after adding the steps that remain in the document.
  nlohmann::ordered_json Result(const json& document) {
    const Node episode(&document, &file_);
    episode.CheckKeys({"robot", "control_frequency", "control_dt", "config", "geoms", "initial", "steps",
                       "stages", "finalize"},
                      {"name", "description", "tags", "quirk", "expected", "expected_every_step",
                       "expected_duration", "analytic", "tolerance"});
    if (!metrics_) Begin(episode);
    episode["steps"].ArraySize();
    for (const json& step : document["steps"]) Add(step);
    SetStages(episode["stages"]);

    const Node finalize = episode["finalize"];
    finalize.CheckKeys({"success", "target_distance", "pose_error"});
    metrics_->SetSuccess(finalize["success"].Bool());
    metric_values_t values{};
    metrics_->Values(&values);
    ReadFinal(finalize["target_distance"], &values.target_distance_name, &values.target_distance_m);
    ReadFinal(finalize["pose_error"], &values.pose_error_name, &values.object_pose_error_rad);
    nlohmann::ordered_json result = ResultJson(values);
    for (const auto& [name, value] : FlattenedValues(result)) {
      if (!std::isfinite(value)) {
        throw InputError(file_ + ": steps: expected values in a physical range, " + std::string(name) +
                         " overflows");
      }
    }
    // An empty object in the input becomes an empty object in the result.
    if (finalize["target_distance"].value() == json::object()) result["target_distance"] = json::object();
    if (finalize["pose_error"].value() == json::object()) result["object_pose_error"] = json::object();
    return result;
  }

 private:
  void Begin(const Node& episode) {
    metrics_.emplace(ReadConfig(episode, options_));
    const MetricsConfig& config = metrics_->config();
    step_.emplace(config);
    const Node initial = episode["initial"];
    initial.CheckKeys(config.grippers);
    for (size_t k = 0; k < config.grippers.size(); ++k) {
      const Node arm = initial[config.grippers[k]];
      arm.CheckKeys({"gripper_opening", "holding"});
      step_->ReadGripper(arm, k);
    }
    metrics_->Start(step_->opening(), step_->holding());
  }

  void Add(const json& step) {
    step_->Read(Node(&step, &file_, "steps[" + std::to_string(num_steps_) + "]"), num_steps_);
    metrics_->Step(step_->AsSample(num_steps_));
    ++num_steps_;
  }

  void SetStages(const Node& stages) {
    const int num_steps = static_cast<int>(num_steps_);
    int last = -1;
    for (size_t k = 0; k < stages.ArraySize(); ++k) {
      const Node event = stages[k];
      event.CheckKeys({"step", "stage", "reached"});
      last = event["step"].Integer(last, num_steps - 1);
      metrics_->SetStage(event["stage"].Integer(1, 1'000'000), event["reached"].Bool());
    }
  }

  std::string file_;
  ScoreOptions options_;
  std::optional<RolloutMetrics> metrics_;
  std::optional<Step> step_;
  int64_t num_steps_ = 0;
};

}  // namespace

nlohmann::ordered_json ScoreEpisode(const json& episode, const std::string& file,
                                    const ScoreOptions& options) {
  return Trajectory(file, options).Result(episode);
}

nlohmann::ordered_json ScoreFile(const std::filesystem::path& file, const ScoreOptions& options) {
  Trajectory trajectory(file.string(), options);
  return trajectory.Result(ReadJsonFile(
      file, "steps", [&](const json& so_far, const json& step) { return trajectory.Take(so_far, step); }));
}

}  // namespace evalbus::metrics
