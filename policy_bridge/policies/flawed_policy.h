// Failures on purpose: another policy with one flaw.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

// To move an object is to have it, or a part of it, 1 cm or 0.1 rad away from where it was when a gripper
// first closed.
enum class Flaw {
  kMiss,     // the hands stay 8 cm short of where they should be
  kSlip,     // the fingers close but hardly squeeze
  kEarly,    // lets go as soon as it has moved an object
  kDrop,     // lets go when an object is 4 cm up
  kStop,     // stops as soon as it has moved an object
  kCollide,  // from home the hands press down
  kSlow,     // takes ten times as long
  kError,    // gives up as soon as it has moved an object
  kNan,      // commands NaN as soon as it has moved an object
};

// The name without its k, in small letters. Throws InputError that lists the names.
Flaw FindFlaw(const std::string& name);
// With commas.
std::string FlawNames();

// Changes the targets of any policy, so it knows of a task no more than its objects.
class FlawedPolicy : public Policy {
 public:
  FlawedPolicy(std::unique_ptr<Policy> policy, Flaw flaw, const mjModel& model, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  // Looks whether it is time to go wrong.
  void Look(const state_t& state, const action_t& action);
  // Moves the grips of all arms from where the action has them: by `back` (m) against their own direction and
  // by `down` (m) in the world, a little to the outside. Out of reach, an arm stays where it is.
  void Shift(double back, double down, action_t* action);

  std::unique_ptr<Policy> policy_;
  Flaw flaw_;
  std::vector<Arm> arms_;
  std::vector<double> side_;  // by arm: 1 left, -1 right, 0 of a single one
  std::vector<int> bodies_;   // of the task's objects
  // Where these were when a gripper first closed; empty before.
  std::vector<Eigen::Isometry3d> start_;
  bool wrong_ = false;
  // The last targets: of all, for kStop and kCollide, and by arm, for Shift().
  action_t last_{};
  std::vector<JointVector> shifted_;
  // What the policy sees, where that is not the state.
  state_t seen_{};
};

}  // namespace evalbus::policy
