// Why an episode ended: the values of episode_end_t.end_reason, which LCM's language cannot name.
#pragma once

#include <cstdint>
#include <string>

#include "evalbus/partial_metrics_t.hpp"

namespace evalbus::end_reason {

// The task's verdict.
inline constexpr char kSuccess[] = "success";
inline constexpr char kFailure[] = "failure";
inline constexpr char kTimeLimit[] = "time_limit";
// What the policy did or said was wrong; its answer did not come in time.
inline constexpr char kPolicyError[] = "policy_error";
inline constexpr char kPolicyTimeout[] = "policy_timeout";
// The policy's server is gone or does not keep to its wire: says nothing of the policy, and is in no rate.
inline constexpr char kServerError[] = "server_error";
// The physics diverged.
inline constexpr char kUnstable[] = "unstable";
// What somebody else recorded, or sends, ends here.
inline constexpr char kEndOfData[] = "end_of_data";
// Its result would say nothing of the policy: begun again, and in no rate.
inline constexpr char kAborted[] = "aborted";

// No end of an episode but a reason why it has no verdict: what success or failure asks for is not known.
// Says nothing of the policy, and is in no rate of success.
inline constexpr char kNotJudged[] = "not_judged";

// What a verdict (partial_metrics_t) ends an episode with; empty while it is undecided.
inline const char* Of(int8_t verdict) {
  return verdict == partial_metrics_t::SUCCESS   ? kSuccess
         : verdict == partial_metrics_t::FAILURE ? kFailure
                                                 : "";
}

// How an episode came out, in the word that people read everywhere: why it did not succeed, or that it did.
inline std::string Outcome(const std::string& failure_reason) {
  return failure_reason.empty() ? kSuccess : failure_reason;
}

}  // namespace evalbus::end_reason
