#include "policy_bridge/policies/replay_policy.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "lcmtypes/clock.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {
namespace {

// Reads the actions of the last attempt of an episode. Throws InputError if the log is damaged, or if actions
// or the end of the episode are missing, because the last action before a gap would silently be held.
RecordedActions ReadActions(const std::filesystem::path& log, int episode) {
  EpisodeReader reader(log, {channels::kAction});
  RecordedActions recorded{.log = log.string(), .episode = {}};
  const auto is_wanted = [episode](int number) { return number == episode; };
  bool is_found = false;
  for (EpisodeMessages read; reader.Next(&read, is_wanted);) {
    if (!is_wanted(read.number())) continue;
    recorded.episode = std::move(read);
    is_found = true;
  }
  if (!is_found && reader.log().damaged_places() == 0) return recorded;
  if (const std::string why = reader.WhyNotWhole(is_found ? &recorded.episode : nullptr); !why.empty())
    throw InputError("policy \"replay\": " + log.string() + ": " + why);
  const bool is_lockstep = recorded.episode.model && recorded.episode.model->clock == clock_name::kLockstep;
  int64_t tick = 0;
  for (const action_t& action : recorded.episode.actions) {
    if (is_lockstep && action.header.tick != tick) {
      throw InputError(fmt::format("policy \"replay\": {} has no action for tick {}", log.string(), tick));
    }
    ++tick;
  }
  return recorded;
}

// Lists the differences between the recording and the run, such as "task lift_pot, not cube_handover; seed 3,
// not 4". Empty if nothing differs.
std::string Differences(const EpisodeMessages& recorded, const model_info_t& run, int64_t seed) {
  const model_info_t was = recorded.model.value_or(model_info_t{});
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
  compare("episode seed", std::to_string(recorded.begin ? recorded.begin->seed : 0), std::to_string(seed));
  if (text.empty() && was.physics_sha256 != run.physics_sha256)
    return "another physics model of the same task, variation and robot";
  return text;
}

}  // namespace

Recording OpenRecording(const std::string& path) {
  if (path.empty()) {
    throw InputError(
        "policy \"replay\": expected replay:PATH, where PATH is a run folder or an LCM event log");
  }
  if (std::filesystem::is_directory(path)) {
    if (!std::filesystem::is_directory(std::filesystem::path(path) / kEpisodesFolder)) {
      throw InputError("policy \"replay\": " + path + " is not a run folder: it has no folder episodes/");
    }
    return [path](int episode) {
      const std::filesystem::path log = EpisodeLog(path, episode);
      return std::filesystem::exists(log) ? ReadActions(log, episode) : RecordedActions{};
    };
  }
  if (!std::filesystem::exists(path)) throw InputError("policy \"replay\": " + path + " does not exist");
  return [path](int episode) { return ReadActions(path, episode); };
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
  RecordedActions recorded = recording_(begin.header.episode);
  next_ = 0;
  actions_ = std::move(recorded.episode.actions);
  if (actions_.empty()) {
    throw InputError("policy \"replay\": the recording has no actions of episode " +
                     std::to_string(begin.header.episode));
  }
  if (const std::string differences = Differences(recorded.episode, info_, begin.seed);
      !anyway_ && !differences.empty()) {
    throw InputError(fmt::format(
        "policy \"replay\": {} was recorded with {}; the same actions would have a different effect "
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
