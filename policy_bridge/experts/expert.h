// Base of the scripted experts: plays motions and asks for the next ones when they have ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "policy_bridge/interface/policy.h"
#include "policy_bridge/planning/plan.h"

namespace evalbus::policy {

// The arms of a robot with two, on +y and -y.
inline constexpr int kLeft = 0, kRight = 1;
// By then what a task drops at time 0 lies still.
inline constexpr int64_t kSettledUs = 500'000;
// Of ways that each arm has, so many are tried with each other.
inline constexpr size_t kPairs = 4;

class Expert : public Policy {
 public:
  // max_attempts: how often it plans in an episode before it gives up.
  Expert(const mjModel& model, const model_info_t& info, int max_attempts);

  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 protected:
  // What to do from `now`, seeing `state`; empty to rest until asked again at the next tick. Where this was
  // the last attempt and the episode has had no plan, Act() throws what was in the way.
  virtual std::vector<Motion> Next(const Configuration& now, const state_t& state) = 0;

  PlanningContext& context() { return context_; }
  // It has planned as often as it may; it rests from now on.
  bool gives_up() const { return attempts_ >= max_attempts_; }
  // Plans in this episode, counted by the expert itself.
  int attempts_ = 0;
  // Of the robot.
  std::vector<int> arms_;

  // A fresh plan from `now`.
  Plan MakePlan(const Configuration& now, const state_t& state) { return Plan(&context_, now, state); }

 private:
  // What is in the way of a plan from `now`.
  std::string WhyNoPlan(const Configuration& now, const state_t& state);

  PlanningContext context_;
  int max_attempts_;
  // Of the arms.
  std::vector<std::string> names_;
  // Some plan of this episode was possible.
  bool has_planned_ = false;
  Player player_;
};

// Throws InputError unless the robot has two arms.
void NeedTwoArms(const model_info_t& info);

// Writes a configuration as an action.
void SetAction(const Configuration& configuration, action_t* action);

// Throws InputError that lists the tasks there is an expert for.
void CheckExpert(const std::string& task);

// The scripted expert for a task, by the task's name: for a copy of it under another name, too. Throws as
// CheckExpert() does.
std::unique_ptr<Policy> MakeExpert(const std::string& task, const mjModel& model, const model_info_t& info);

}  // namespace evalbus::policy
