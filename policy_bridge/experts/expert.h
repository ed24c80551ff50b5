// Base of the scripted experts: plays motions and asks for the next ones when they have ended.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "policy_bridge/planning/plan.h"
#include "policy_bridge/policy.h"

namespace evalbus::policy {

class Expert : public Policy {
 public:
  Expert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 protected:
  // What to do from `now`, seeing `state`; empty to rest until asked again at the next tick. Throws
  // std::runtime_error where nothing can be done.
  virtual std::vector<Motion> Next(const Configuration& now, const state_t& state) = 0;

  PlanningContext& context() { return context_; }
  // How often the expert has planned in this episode, counted by itself; at some number it gives up.
  int attempts_ = 0;

  // A fresh plan from `now`.
  Plan MakePlan(const Configuration& now, const state_t& state) { return Plan(&context_, now, state); }

 private:
  PlanningContext context_;
  Player player_;
};

// Throws InputError unless the robot has two arms.
void NeedTwoArms(const model_info_t& info);

// Writes a configuration as an action.
void SetAction(const Configuration& configuration, action_t* action);

// The scripted expert for a task. Throws InputError that lists the tasks there is one for.
std::unique_ptr<Policy> MakeExpert(const mjModel& model, const model_info_t& info);

}  // namespace evalbus::policy
