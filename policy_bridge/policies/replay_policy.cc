#include "policy_bridge/policies/replay_policy.h"

#include <filesystem>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {
namespace {

std::vector<action_t> ReadActions(const std::filesystem::path& log, int episode) {
  EventLogReader reader(log);
  std::vector<action_t> actions;
  LogEvent event;
  action_t action{};
  while (reader.Next(&event)) {
    if (event.channel != channels::kAction || !Decode(event.data, &action)) continue;
    if (action.header.episode != episode) continue;
    // An episode that was begun again starts over.
    while (!actions.empty() && actions.back().header.tick >= action.header.tick) actions.pop_back();
    actions.push_back(action);
  }
  // The gaps would be filled with actions that were held.
  if (reader.damaged_places() > 0) {
    throw InputError("policy \"replay\": " + log.string() +
                     " is damaged: " + std::to_string(reader.damaged_bytes()) + " bytes are no events");
  }
  return actions;
}

}  // namespace

Recording OpenRecording(const std::string& path) {
  if (path.empty()) {
    throw InputError("policy \"replay\": replay:PATH expected, with a run folder or an LCM event log");
  }
  if (std::filesystem::is_directory(path)) {
    if (!std::filesystem::is_directory(std::filesystem::path(path) / kEpisodesFolder)) {
      throw InputError("policy \"replay\": " + path + " is no run folder: it has no folder episodes/");
    }
    return [path](int episode) {
      const std::filesystem::path log = EpisodeLog(path, episode);
      return std::filesystem::exists(log) ? ReadActions(log, episode) : std::vector<action_t>{};
    };
  }
  if (!std::filesystem::exists(path)) throw InputError("policy \"replay\": " + path + " does not exist");
  return [path](int episode) { return ReadActions(path, episode); };
}

ReplayPolicy::ReplayPolicy(Recording recording, const model_info_t& info)
    : recording_(std::move(recording)), num_joints_(CountJoints(info)), num_grippers_(info.gripper.size()) {}

void ReplayPolicy::Begin(const episode_begin_t& begin) {
  actions_ = recording_(begin.header.episode);
  next_ = 0;
  if (actions_.empty()) {
    throw InputError("policy \"replay\": the recording has no actions of episode " +
                     std::to_string(begin.header.episode));
  }
  for (const action_t& action : actions_) {
    if (action.joint_position_rad.size() != num_joints_ || action.gripper_closing.size() != num_grippers_) {
      throw InputError("policy \"replay\": the recording is of another robot: " +
                       std::to_string(action.joint_position_rad.size()) + " joints and " +
                       std::to_string(action.gripper_closing.size()) + " grippers, not " +
                       std::to_string(num_joints_) + " and " + std::to_string(num_grippers_));
    }
  }
}

void ReplayPolicy::Act(const state_t& state, action_t* action) {
  while (next_ + 1 < actions_.size() && actions_[next_ + 1].header.sim_time_us <= state.header.sim_time_us)
    ++next_;
  *action = actions_[next_];
}

}  // namespace evalbus::policy
