// Tests a policy server with one observation before a run.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "policy_bridge/contract/contract.h"
#include "policy_bridge/remote/observation_builder.h"

namespace evalbus::policy {

struct CheckLine {
  enum class Level { kGood, kNote, kSuspicious, kBad };
  Level level = Level::kGood;
  std::string text;
};

struct CheckReport {
  // kUnreachable, kProtocol or kContract: the first failure that was found. kSuspicious: no failure was
  // found, but something in the answers is doubtful.
  enum class Verdict { kGood, kUnreachable, kProtocol, kContract, kSuspicious };
  Verdict verdict = Verdict::kGood;
  std::vector<CheckLine> lines;
  // Durations of successful calls in seconds: duration of the first call, and median of the later calls. -1:
  // there were none.
  double first_call_s = -1, steady_call_s = -1;
  // Largest difference between the first answer and later answers to the same observation, or -1 if it was
  // not tested.
  double repeat_difference = -1;
  int num_steps = 0;
  // Minimum and maximum of each value over the action chunk.
  std::vector<double> least, most;
};

// Returns "good", "unreachable", "protocol", "contract" or "suspicious".
const char* NameOf(CheckReport::Verdict verdict);

// Calls the server several times with the observation of this state. The images must be in the order of
// observations->views(). Each call blocks at most until the contract's deadline. Throws InputError if the
// contract does not fit the robot.
CheckReport CheckPolicyServer(const Contract& contract, PolicyClient* client, const mjModel& model,
                              const model_info_t& info, const state_t& state,
                              const std::vector<image_t>& images, ObservationBuilder* observations);

nlohmann::ordered_json CheckJson(const Contract& contract, const CheckReport& report);

}  // namespace evalbus::policy
