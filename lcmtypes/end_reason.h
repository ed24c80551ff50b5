// Reasons why an episode ended: the values of episode_end_t.end_reason. They are defined here because LCM's
// language has no string constants.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "evalbus/partial_metrics_t.hpp"

namespace evalbus::end_reason {

// The task's verdict.
inline constexpr char kSuccess[] = "success";
inline constexpr char kFailure[] = "failure";
inline constexpr char kTimeLimit[] = "time_limit";
// kPolicyError: the policy raised an error or sent an invalid action. kPolicyTimeout: its answer did not
// arrive in time.
inline constexpr char kPolicyError[] = "policy_error";
inline constexpr char kPolicyTimeout[] = "policy_timeout";
// The policy's server disconnected or violated its protocol. No conclusion about the policy can be drawn, and
// the episode counts in no rate.
inline constexpr char kServerError[] = "server_error";
// The physics diverged.
inline constexpr char kUnstable[] = "unstable";
// A recorded trajectory or an external source has ended.
inline constexpr char kEndOfData[] = "end_of_data";
// The episode was disturbed, or the run was stopped. The launcher discards the attempt and begins another one
// if the run continues. It counts in no rate.
inline constexpr char kAborted[] = "aborted";

// The episode has no verdict, because quantities that its success or failure condition needs are unavailable.
// This does not describe how the episode ended. No conclusion about the policy can be drawn, so no success
// rate counts the episode.
inline constexpr char kNotJudged[] = "not_judged";

// Returns the end reason for a verdict (partial_metrics_t); empty while it is undecided.
inline const char* Of(int8_t verdict) {
  return verdict == partial_metrics_t::SUCCESS   ? kSuccess
         : verdict == partial_metrics_t::FAILURE ? kFailure
                                                 : "";
}

// Returns the text that users see for an end reason or a failure reason, which are identifiers such as
// "grasp_slip". viz/viewer/page/dom.js has the same texts. Files and messages contain the identifiers.
inline std::string Text(std::string reason) {
  if (reason == "grasp_slip") return "slipped from the gripper";
  if (reason == "grasp_miss") return "missed the grasp";
  if (reason == "wrong_pose") return "target pose not reached";
  if (reason == "stall") return "robot stopped";
  if (reason == "timeout") return "time limit";
  std::ranges::replace(reason, '_', ' ');
  return reason;
}

// Returns the outcome of an episode in words: "success", or the reason for the failure.
inline std::string Outcome(const std::string& failure_reason) {
  return failure_reason.empty() ? kSuccess : Text(failure_reason);
}

}  // namespace evalbus::end_reason
