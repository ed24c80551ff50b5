// Makes a scripted policy take simulated time to compute, as a policy behind a server does (docs/latency.md).
#pragma once

#include <array>
#include <memory>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/actions/chunk_schedule.h"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/remote/latency.h"

namespace evalbus::policy {

// Treats another policy as a policy that returns action chunks. A chunk contains the actions that the wrapped
// policy commands if it observes nothing after the tick at which the inference began. The wrapped policy is
// therefore called with the state of that tick, and with a time that advances by one tick per action. This
// time stands still while the robot holds its last command. A scripted policy continues its own plan from one
// chunk to the next, so its chunks need no joining: `rtc` has the same effect as `asynchronous`.
class DelayedPolicy : public Policy {
 public:
  // kExecutedPart: duration of the part of a chunk that is executed before the next inference begins.
  // kChunkFactor: length of a chunk as a multiple of that part. For comparison, pi0 executes 25 of 50 steps
  // at 50 Hz.
  static constexpr double kExecutedPart = 0.5;  // s
  static constexpr int kChunkFactor = 2;

  // latency: must be Kind::kFixed.
  DelayedPolicy(std::unique_ptr<Policy> policy, const Latency& latency, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;
  bool IsReady() override { return policy_->IsReady(); }
  void SetCallbacks(const PolicyCallbacks& callbacks) override;

  // Returns the number of steps of a chunk that are executed before the next inference begins.
  static int ExecuteSteps(double tick_s);

 private:
  void Infer(const state_t& state);

  std::unique_ptr<Policy> policy_;
  PolicyCallbacks callbacks_;
  int64_t tick_us_;
  int execute_steps_;
  int64_t delay_;  // ticks
  ChunkSchedule schedule_;
  // States that were observed for the last chunk with an even number and the last chunk with an odd number.
  std::array<state_t, 2> observed_;
  // Number of actions that the wrapped policy has returned in this episode.
  int64_t num_acted_ = 0;
  action_t last_{};
};

}  // namespace evalbus::policy
