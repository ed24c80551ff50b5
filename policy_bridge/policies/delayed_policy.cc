#include "policy_bridge/policies/delayed_policy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "policy_bridge/actions/holding_action.h"

namespace evalbus::policy {

int DelayedPolicy::ExecuteSteps(double tick_s) {
  return std::max(1, static_cast<int>(std::lround(kExecutedPart / tick_s)));
}

DelayedPolicy::DelayedPolicy(std::unique_ptr<Policy> policy, const Latency& latency, const model_info_t& info)
    : policy_(std::move(policy)),
      tick_us_(info.timestep_us * info.substeps),
      execute_steps_(ExecuteSteps(static_cast<double>(tick_us_) / 1e6)),
      delay_(HeldTicks(latency.fixed_s, static_cast<double>(tick_us_) / 1e6)),
      schedule_(latency.execution, execute_steps_) {}

void DelayedPolicy::SetCallbacks(const PolicyCallbacks& callbacks) {
  callbacks_ = callbacks;
  policy_->SetCallbacks(callbacks);
}

void DelayedPolicy::Begin(const episode_begin_t& begin) {
  policy_->Begin(begin);
  schedule_.Begin();
  num_acted_ = 0;
  last_ = {};
}

void DelayedPolicy::Infer(const state_t& state) {
  const int64_t tick = state.header.tick;
  schedule_.Ask(tick);
  const int64_t chunk = schedule_.Arrive(tick + delay_, kChunkFactor * execute_steps_);
  observed_[static_cast<size_t>(chunk % 2)] = state;
  if (!callbacks_.on_policy_action) return;
  // The message contains no rows, because they are not known in advance. The executed actions are in ACTION.
  policy_action_t answer{};
  answer.header = state.header;
  answer.kind = "scripted";
  answer.execute_steps = execute_steps_;
  answer.server_s = -1;
  answer.held_ticks = static_cast<int32_t>(delay_);
  callbacks_.on_policy_action(answer);
}

void DelayedPolicy::Act(const state_t& state, action_t* action) {
  const int64_t tick = state.header.tick;
  if (last_.joint_position_rad.empty()) last_ = HoldingAction(state);
  if (schedule_.IsDue(tick)) Infer(state);
  if (const auto step = schedule_.At(tick)) {
    state_t& observed = observed_[static_cast<size_t>(step->chunk % 2)];
    observed.header.tick = num_acted_;
    observed.header.sim_time_us = num_acted_ * tick_us_;
    ++num_acted_;
    policy_->Act(observed, action);
    last_ = *action;
    return;
  }
  *action = last_;
  action->unreachable_poses = action->singular_poses = 0;
}

}  // namespace evalbus::policy
