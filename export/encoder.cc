#include "export/encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/json_file.h"
#include "bus/channels.h"
#include "export/schemas.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/episode/result_json.h"
#include "metrics/statistics/run_statistics.h"
#include "models/model_names.h"

namespace evalbus::exports {
namespace {

using Json = nlohmann::ordered_json;
using Kind = viz::TrackEvent::Kind;

constexpr int64_t kNsPerUs = 1000;
constexpr char kWorld[] = "world";
// Levels of foxglove.Log, indexed by log_t.level.
constexpr int kLevels[] = {1, 2, 3, 4};
constexpr double kMarkDiameter_m = 0.008, kNormalLength_m = 0.05;

Json VectorJson(const double* v) { return {{"x", v[0]}, {"y", v[1]}, {"z", v[2]}}; }
// Converts a quaternion (w, x, y, z) to JSON.
Json QuaternionJson(const double* q) { return {{"x", q[1]}, {"y", q[2]}, {"z", q[3]}, {"w", q[0]}}; }

template <size_t N>
bool AreNumbers(const double (&values)[N]) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

// Returns the shortest rotation of the x axis onto a unit vector, as a quaternion (w, x, y, z).
std::array<double, 4> TurnOntoX(const double* to) {
  if (to[0] < -1 + 1e-9) return {0, 0, 0, 1};
  const double w = 1 + to[0], norm = std::sqrt(w * w + to[1] * to[1] + to[2] * to[2]);
  return {w / norm, 0, -to[2] / norm, to[1] / norm};
}

// Returns the suffix for a unit, for example "_m" for "m"; empty for counts and fractions.
std::string UnitSuffix(std::string_view unit) {
  constexpr std::pair<std::string_view, std::string_view> kSuffixes[] = {
      {"m", "_m"},         {"rad", "_rad"},   {"s", "_s"},
      {"rad/s", "_radps"}, {"m/s³", "_mps3"}, {"rad/s³", "_radps3"}};
  for (const auto& [known, suffix] : kSuffixes) {
    if (known == unit) return std::string(suffix);
  }
  return "";
}

// Sets {"a": {"b": value}} for the path "a.b".
void Put(const std::string& path, double value, Json* json) {
  size_t begin = 0;
  for (size_t dot; (dot = path.find('.', begin)) != path.npos; begin = dot + 1) {
    json = &(*json)[path.substr(begin, dot - begin)];
    if (!json->is_object() && !json->is_null()) return;
  }
  (*json)[path.substr(begin)] = value;
}

// Returns the finite values by their names in episodes.jsonl.
metrics::NamedNumbers Values(const partial_metrics_t& partial) {
  metrics::NamedNumbers values = metrics::FlattenedValues(metrics::ResultJson(partial.metrics));
  const metrics::NamedNumbers extended =
      metrics::FlattenedValues(metrics::ExtendedJson(partial.extended, partial.metrics), "extended");
  values.insert(values.end(), extended.begin(), extended.end());
  std::erase_if(values, [](const auto& entry) { return !std::isfinite(entry.second); });
  return values;
}

}  // namespace

Json TimeJson(int64_t time_ns) {
  return {{"sec", time_ns / 1'000'000'000}, {"nsec", time_ns % 1'000'000'000}};
}

std::string NameWithUnit(const std::string& name) {
  const MetricNumber number = FindMetric(name);
  // Names of extended metrics already end in their units.
  if (!number.metric || number.metric->is_extended()) return name;
  const size_t end = number.of.empty() ? name.size() : name.size() - number.of.size() - 1;
  return name.substr(0, end) + UnitSuffix(number.metric->unit) + name.substr(end);
}

Encoder::Encoder(Emit emit, SceneOf scene) : emit_(std::move(emit)), scene_(std::move(scene)) {
  topics_ = {{"/tf", "foxglove.FrameTransforms", FrameTransformsSchema()},
             {"/scene", "foxglove.SceneUpdate", SceneUpdateSchema()},
             {"/contact_marks", "foxglove.SceneUpdate", SceneUpdateSchema()},
             {"/joint_states", "foxglove.JointStates", JointStatesSchema()},
             {"/joint_commands", "foxglove.JointStates", JointStatesSchema()},
             {"/robot", "evalbus.Robot", RobotSchema()},
             {"/contacts", "evalbus.Contacts", ContactsSchema()},
             {"/events", "evalbus.Event", EventSchema()},
             {"/log", "foxglove.Log", LogSchema()},
             {"/episode", "evalbus.Episode", EpisodeSchema()}};
}

void Encoder::Receive(std::string_view channel, std::span<const uint8_t> data) {
  if (channels::kModel == channel && !UpdateIfChanged(data, &model_bytes_)) return;
  undecodable_ += !channels::Dispatch(
      channel, data, [this](const auto& message) { Receive(message); }, channels::kState, channels::kContacts,
      channels::kPartial, channels::kAction, channels::kModel, channels::kEpisodeBegin, channels::kEpisodeEnd,
      channels::kEpisodeSummary, channels::kLog);
}

void Encoder::Receive(const model_info_t& model) {
  model_ = std::make_shared<const model_info_t>(model);
  track_.reset();
  metrics_topic_.reset();
}

void Encoder::Receive(const episode_begin_t& begin) {
  if (!IsPlausible(begin.header) || !model_) return;
  if (begin_ && IsOurs(begin.header) && begin_->seed == begin.seed) return;  // a repeated message
  begin_ = begin;
  track_.reset();
  Enter(begin.header);
}

void Encoder::Enter(const header_t& header) {
  if (!model_ || IsOurs(header)) return;
  try {
    track_ = std::make_unique<viz::EpisodeTrack>(model_, header, viz::EpisodeTrack::About{});
  } catch (const InputError&) {
    ++undecodable_;  // the MODEL is inconsistent
    model_.reset();
    return;
  }
  ++num_attempts_;
  emitted_events_.clear();
  time_ns_ = -1;
  const bool has_begin = begin_ && IsOurs(begin_->header);
  if (has_begin) track_->Receive(*begin_);
  EmitEpisode(nullptr);
  const auto entities =
      scene_ ? scene_(*model_, has_begin ? std::optional(begin_->seed) : std::nullopt) : nullptr;
  if (!entities) return;
  // Removes the entities of the previous episode's model.
  const Json deletions = Json::array({{{"timestamp", TimeJson(0)}, {"type", 1}, {"id", ""}}});
  emit_({kScene, 0,
         std::make_shared<const std::string>("{\"deletions\":" + ToText(deletions) +
                                             ",\"entities\":" + *entities + "}")});
}

std::string Encoder::FrameName(size_t body) const {
  const std::string& name = model_->body_name[body];
  return name.empty() ? fmt::format("body {}", body) : name;
}

void Encoder::Receive(const state_t& state) {
  if (!IsPlausible(state.header)) return;
  Enter(state.header);
  if (!track_ || state.body.size() != model_->body_name.size() || state.arm.size() != model_->arm.size() ||
      state.gripper.size() != model_->gripper.size()) {
    return;
  }
  const int64_t time = state.header.sim_time_us * kNsPerUs;
  if (time <= time_ns_) return;  // a repeated message
  time_ns_ = time;
  const Json stamp = TimeJson(time);
  track_->Receive(state);

  Json transforms = Json::array();
  for (size_t body = 1; body < state.body.size(); ++body) {
    const body_pose_t& pose = state.body[body];
    if (!AreNumbers(pose.position_m) || !AreNumbers(pose.quat_wxyz)) continue;
    transforms.push_back({{"timestamp", stamp},
                          {"parent_frame_id", kWorld},
                          {"child_frame_id", FrameName(body)},
                          {"translation", VectorJson(pose.position_m)},
                          {"rotation", QuaternionJson(pose.quat_wxyz)}});
  }
  EmitJson(kTransforms, time, {{"transforms", std::move(transforms)}});

  Json joints = Json::array(), wrists = Json::object(), openings = Json::object();
  for (size_t k = 0; k < state.arm.size(); ++k) {
    const arm_state_t& arm = state.arm[k];
    const arm_info_t& info = model_->arm[k];
    for (size_t j = 0; j < info.joint_name.size() && j < arm.joint_position_rad.size(); ++j) {
      if (!std::isfinite(arm.joint_position_rad[j])) continue;
      Json joint = {{"name", info.joint_name[j]}, {"position", arm.joint_position_rad[j]}};
      if (std::isfinite(arm.joint_velocity_radps[j])) joint["velocity"] = arm.joint_velocity_radps[j];
      if (model_->has_physics && std::isfinite(arm.joint_torque_Nm[j])) {
        joint["effort"] = arm.joint_torque_Nm[j];
      }
      joints.push_back(std::move(joint));
    }
    if (!AreNumbers(arm.wrist_position_m) || !AreNumbers(arm.wrist_quat_wxyz)) continue;
    Json& wrist = wrists[info.name] = {{"position_m", VectorJson(arm.wrist_position_m)},
                                       {"orientation", QuaternionJson(arm.wrist_quat_wxyz)}};
    if (model_->has_physics && std::isfinite(arm.mechanical_work_J)) {
      wrist["mechanical_work_J"] = arm.mechanical_work_J;
    }
  }
  for (size_t k = 0; k < state.gripper.size(); ++k) {
    if (std::isfinite(state.gripper[k].opening)) {
      openings[model_->gripper[k].name] = state.gripper[k].opening;
    }
  }
  EmitJson(kJoints, time, {{"timestamp", stamp}, {"joints", std::move(joints)}});
  EmitJson(kRobot, time,
           {{"timestamp", stamp},
            {"tick", state.header.tick},
            {"wrist", std::move(wrists)},
            {"gripper_opening", std::move(openings)},
            {"action_clips", state.action_clips},
            {"deadline_misses", state.deadline_misses}});
}

void Encoder::Receive(const action_t& action) {
  if (!IsOurs(action.header) || action.mode != action_t::JOINT_POSITION) return;
  const int64_t time = action.header.sim_time_us * kNsPerUs;
  Json joints = Json::array();
  size_t at = 0;
  for (const arm_info_t& arm : model_->arm) {
    for (const std::string& name : arm.joint_name) {
      if (at >= action.joint_position_rad.size()) return;
      const double position = action.joint_position_rad[at++];
      if (std::isfinite(position)) joints.push_back({{"name", name}, {"position", position}});
    }
  }
  EmitJson(kJointCommands, time, {{"timestamp", TimeJson(time)}, {"joints", std::move(joints)}});
}

void Encoder::Receive(const contacts_t& contacts) {
  if (!IsOurs(contacts.header)) return;
  const int64_t time = contacts.header.sim_time_us * kNsPerUs;
  const Json stamp = TimeJson(time);
  track_->Receive(contacts);
  const ModelNames names(*model_);
  const auto name = [&](int geom) {
    return geom >= 0 && geom < model_->num_geoms ? names.GeomName(geom) : fmt::format("geom {}", geom);
  };
  Json list = Json::array(), balls = Json::array(), arrows = Json::array();
  const Json color = {{"r", 0.84}, {"g", 0.37}, {"b", 0.0}, {"a", 1.0}};
  for (const contact_t& contact : contacts.contact) {
    if (!AreNumbers(contact.position_m) || !AreNumbers(contact.normal) ||
        !std::isfinite(contact.distance_m)) {
      continue;
    }
    const Json position = VectorJson(contact.position_m);
    list.push_back({{"a", name(contact.geom_a)},
                    {"b", name(contact.geom_b)},
                    {"distance_m", contact.distance_m},
                    {"position_m", position},
                    {"normal", VectorJson(contact.normal)}});
    const double none[] = {1, 0, 0, 0}, size[] = {kMarkDiameter_m, kMarkDiameter_m, kMarkDiameter_m};
    balls.push_back({{"pose", {{"position", position}, {"orientation", QuaternionJson(none)}}},
                     {"size", VectorJson(size)},
                     {"color", color}});
    arrows.push_back(
        {{"pose",
          {{"position", position}, {"orientation", QuaternionJson(TurnOntoX(contact.normal).data())}}},
         {"shaft_length", 0.8 * kNormalLength_m},
         {"shaft_diameter", 0.3 * kMarkDiameter_m},
         {"head_length", 0.2 * kNormalLength_m},
         {"head_diameter", 0.8 * kMarkDiameter_m},
         {"color", color}});
  }
  Json json = {{"timestamp", stamp}, {"tick", contacts.header.tick}, {"count", list.size()}};
  if (contacts.has_clearance && std::isfinite(contacts.clearance_m)) {
    json["clearance_m"] = contacts.clearance_m;
  }
  json["contacts"] = std::move(list);
  EmitJson(kContacts, time, json);
  EmitJson(kContactMarks, time,
           {{"deletions", Json::array()},
            {"entities", Json::array({{{"timestamp", stamp},
                                       {"frame_id", kWorld},
                                       {"id", "contacts"},
                                       {"lifetime", TimeJson(0)},
                                       {"frame_locked", true},
                                       {"metadata", Json::array()},
                                       {"arrows", std::move(arrows)},
                                       {"cubes", Json::array()},
                                       {"spheres", std::move(balls)},
                                       {"cylinders", Json::array()},
                                       {"lines", Json::array()},
                                       {"triangles", Json::array()},
                                       {"texts", Json::array()},
                                       {"models", Json::array()}}})}});
}

void Encoder::Receive(const partial_metrics_t& partial) {
  if (!IsOurs(partial.header) || !IsPlausible(partial.header)) return;
  track_->Receive(partial);
  const auto values = Values(partial);
  if (!metrics_topic_) {
    std::vector<std::pair<std::string, std::string>> paths;
    for (const auto& [key, value] : values) {
      const std::string name(key);
      paths.emplace_back(NameWithUnit(name), FindMetric(name).label());
    }
    Topic topic{"/metrics", "evalbus.Metrics", MetricsSchema(paths)};
    // Only the latest "/metrics" can be used again, because it has replaced the earlier ones.
    const auto latest = std::find_if(topics_.rbegin(), topics_.rend(),
                                     [&](const Topic& other) { return other.name == topic.name; });
    if (latest == topics_.rend() || latest->schema != topic.schema) {
      metrics_topic_ = topics_.size();
      topics_.push_back(std::move(topic));
    } else {
      metrics_topic_ = static_cast<size_t>(topics_.rend() - latest) - 1;
    }
  }
  const int64_t time = partial.header.sim_time_us * kNsPerUs;
  Json json = {{"timestamp", TimeJson(time)},
               {"episode", partial.header.episode},
               {"tick", partial.header.tick},
               {"verdict", partial.verdict}};
  for (const auto& [name, value] : values) Put(NameWithUnit(std::string(name)), value, &json);
  EmitJson(*metrics_topic_, time, json);
  EmitEvents();
}

void Encoder::Receive(const episode_end_t& end) {
  if (IsOurs(end.header)) track_->Receive(end);
}

void Encoder::Receive(const episode_summary_t& summary) {
  if (!IsOurs(summary.header) || track_->summary()) return;
  track_->Receive(summary);
  EmitEvents();
  EmitEpisode(&summary);
}

void Encoder::EmitEpisode(const episode_summary_t* summary) {
  const header_t& header = track_->episode();
  const int64_t time = summary ? summary->header.sim_time_us * kNsPerUs : 0;
  Json json = {{"timestamp", TimeJson(time)}, {"run_id", model_->run_id},
               {"task", model_->task},        {"variation", model_->variation},
               {"robot", model_->robot},      {"instruction", model_->instruction},
               {"episode", header.episode},   {"attempt", header.attempt}};
  if (begin_ && IsOurs(begin_->header)) {
    json["seed"] = std::to_string(begin_->seed);
    Json& parameters = json["parameters"] = Json::object();
    for (size_t k = 0; k < begin_->parameter_name.size(); ++k) {
      if (std::isfinite(begin_->parameter_value_mixed[k])) {
        parameters[begin_->parameter_name[k]] = begin_->parameter_value_mixed[k];
      }
    }
  }
  if (summary) {
    json["end_reason"] = summary->end_reason;
    json["failure_reason"] = summary->failure_reason;
    json["explanation"] = summary->explanation.text;
    json["success"] = summary->verdict == partial_metrics_t::SUCCESS;
    json["complete"] = summary->complete != 0;
  }
  EmitJson(kEpisode, time, json);
}

void Encoder::EmitEvents() {
  // With the summary, only the end and the cause are emitted. The summary describes other events more
  // precisely, but they have already been published and cannot be changed.
  const bool only_end = track_->summary() != nullptr;
  for (const viz::TrackEvent& event : track_->Events()) {
    const bool is_of_end = event.kind == Kind::kEnd || event.kind == Kind::kCause;
    if (is_of_end != only_end) continue;
    if (!emitted_events_.emplace(static_cast<int>(event.kind), event.tick, event.text).second) continue;
    const int64_t time = std::max<int64_t>(0, std::llround(event.time * 1e6) * kNsPerUs);
    EmitJson(kEvents, time,
             {{"timestamp", TimeJson(time)},
              {"tick", event.tick},
              {"kind", viz::Word(event.kind)},
              {"text", event.text},
              {"gripper", event.gripper},
              {"object", event.object},
              {"duration_s", event.duration}});
    EmitLog(time, kLevels[log_t::INFO_LEVEL], "metrics", event.text);
  }
}

void Encoder::Receive(const log_t& line) {
  const int level = std::clamp<int>(line.level, 0, std::size(kLevels) - 1);
  // If the message belongs to another episode or to none, the current time is the best estimate.
  const int64_t time =
      IsOurs(line.header) && line.header.tick >= 0 ? line.header.sim_time_us * kNsPerUs : time_ns_;
  EmitLog(std::max<int64_t>(time, 0), kLevels[level], line.component, line.text);
}

void Encoder::EmitLog(int64_t time_ns, int level, const std::string& name, const std::string& text) {
  EmitJson(kLog, time_ns,
           {{"timestamp", TimeJson(time_ns)},
            {"level", level},
            {"message", text},
            {"name", name},
            {"file", ""},
            {"line", 0}});
}

void Encoder::EmitJson(size_t topic, int64_t time_ns, const Json& json) {
  emit_({topic, time_ns, std::make_shared<const std::string>(ToText(json))});
}

}  // namespace evalbus::exports
