#include "policy_bridge/policies/replay_policy.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "lcmtypes/clock.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {
namespace {

RecordedEpisode ReadEpisode(const std::filesystem::path& log, int episode) {
  EventLogReader reader(log);
  RecordedEpisode recorded;
  recorded.log = log.string();
  std::vector<action_t>& actions = recorded.actions;
  std::vector<uint8_t> model;  // the last one before the episode
  LogEvent event;
  action_t action{};
  episode_begin_t begin{};
  while (reader.Next(&event)) {
    if (event.channel == channels::kModel) model.assign(event.data.begin(), event.data.end());
    if (event.channel == channels::kEpisodeBegin && Decode(event.data, &begin) &&
        begin.header.episode == episode) {
      recorded.begin = begin;
      Decode(model, &recorded.model);
    }
    if (event.channel != channels::kAction || !Decode(event.data, &action)) continue;
    if (action.header.episode != episode) continue;
    // If an episode was restarted, its earlier actions are replaced.
    while (!actions.empty() && actions.back().header.tick >= action.header.tick) actions.pop_back();
    actions.push_back(action);
  }
  // Gaps cannot be tolerated: the previous action would silently be held in them.
  if (reader.damaged_places() > 0) {
    throw InputError("policy \"replay\": " + log.string() +
                     " is damaged: " + std::to_string(reader.damaged_bytes()) + " bytes are damaged");
  }
  return recorded;
}

// Lists what differs between the recording and the run: "task lift_pot, not cube_handover; seed 3, not 4".
// Empty if nothing differs.
std::string Differences(const RecordedEpisode& recorded, const model_info_t& run, int64_t seed) {
  const model_info_t& was = recorded.model;
  std::string text;
  const auto compare = [&](const std::string& what, const std::string& recorded_value,
                           const std::string& value) {
    if (recorded_value == value) return;
    text += (text.empty() ? "" : "; ") + what + " " + recorded_value + ", not " + value;
  };
  const auto hz = [](const model_info_t& model) { return fmt::format("{:g} Hz", 1 / ControlPeriod(model)); };
  compare("task", was.task, run.task);
  compare("variation", was.variation, run.variation);
  compare("robot", was.robot, run.robot);
  compare("control rate", hz(was), hz(run));
  compare("seed of the episode", std::to_string(recorded.begin.seed), std::to_string(seed));
  if (text.empty() && was.physics_sha256 != run.physics_sha256)
    return "another physics model of the same name";
  return text;
}

}  // namespace

Recording OpenRecording(const std::string& path) {
  if (path.empty()) {
    throw InputError("policy \"replay\": replay:PATH expected, with a run folder or an LCM event log");
  }
  if (std::filesystem::is_directory(path)) {
    if (!std::filesystem::is_directory(std::filesystem::path(path) / kEpisodesFolder)) {
      throw InputError("policy \"replay\": " + path + " is not a run folder: it has no folder episodes/");
    }
    return [path](int episode) {
      const std::filesystem::path log = EpisodeLog(path, episode);
      return std::filesystem::exists(log) ? ReadEpisode(log, episode) : RecordedEpisode{};
    };
  }
  if (!std::filesystem::exists(path)) throw InputError("policy \"replay\": " + path + " does not exist");
  return [path](int episode) { return ReadEpisode(path, episode); };
}

std::string RecordingPath(const std::string& policy) {
  for (const std::string prefix : {"replay:", "replay_anyway:"}) {
    if (policy.starts_with(prefix)) return policy.substr(prefix.size());
  }
  return "";
}

ReplayPolicy::ReplayPolicy(Recording recording, const model_info_t& info, bool anyway)
    : recording_(std::move(recording)), info_(info), anyway_(anyway) {}

void ReplayPolicy::Begin(const episode_begin_t& begin) {
  RecordedEpisode recorded = recording_(begin.header.episode);
  next_ = 0;
  actions_ = std::move(recorded.actions);
  if (actions_.empty()) {
    throw InputError("policy \"replay\": the recording has no actions of episode " +
                     std::to_string(begin.header.episode));
  }
  if (const std::string differences = Differences(recorded, info_, begin.seed);
      !anyway_ && !differences.empty()) {
    throw InputError(
        fmt::format("policy \"replay\": {} was recorded with {}; the same actions would have another effect "
                    "(\"replay_anyway:...\" replays them regardless)",
                    recorded.log, differences));
  }
  const size_t num_joints = CountJoints(info_), num_grippers = info_.gripper.size();
  for (const action_t& action : actions_) {
    if (action.joint_position_rad.size() != num_joints || action.gripper_closing.size() != num_grippers) {
      throw InputError("policy \"replay\": the recording is of another robot: " +
                       std::to_string(action.joint_position_rad.size()) + " joints and " +
                       std::to_string(action.gripper_closing.size()) + " grippers, not " +
                       std::to_string(num_joints) + " and " + std::to_string(num_grippers));
    }
  }
}

void ReplayPolicy::Act(const state_t& state, action_t* action) {
  while (next_ + 1 < actions_.size() && actions_[next_ + 1].header.sim_time_us <= state.header.sim_time_us)
    ++next_;
  *action = actions_[next_];
}

}  // namespace evalbus::policy
