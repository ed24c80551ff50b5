// Wraps another policy and adds one flaw, so that it fails in a known way.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

// An object counts as moved if one of its bodies is at least 1 cm or 0.1 rad away from its pose at the time
// when a gripper first closed.
enum class Flaw {
  kMiss,     // the hands stay 8 cm short of their targets
  kSlip,     // the grippers open for 0.1 s of every half second once an object has moved
  kEarly,    // the grippers open as soon as an object has moved
  kDrop,     // the grippers open when an object has risen by 2 cm
  kStop,     // arms and grippers stop as soon as an object has moved
  kCollide,  // the hands press down and outward from the home position
  kSlow,     // everything takes ten times as long
  kError,    // the policy reports an error as soon as an object has moved
  kNan,      // the policy commands NaN as soon as an object has moved
};

// Finds a flaw by name, such as "miss" for kMiss. Throws InputError with the valid names.
Flaw FindFlaw(const std::string& name);
// Returns the names of all flaws, separated by commas.
std::string FlawNames();

// Changes the targets of another policy. It uses only the time and the poses of objects in the state.
class FlawedPolicy : public Policy {
 public:
  FlawedPolicy(std::unique_ptr<Policy> policy, Flaw flaw, const mjModel& model, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  // Sets wrong_ if the flaw becomes active in this state.
  void CheckTrigger(const state_t& state, const action_t& action);
  // Shifts the grip targets of all arms in `action`: by `back` (m) along the hand's own axis toward the
  // wrist, and by `down` (m) downward and 0.7 `down` outward in the world frame. An arm whose
  // shifted target is out of reach keeps its last target.
  void Shift(double back, double down, action_t* action);

  std::unique_ptr<Policy> policy_;
  Flaw flaw_;
  std::vector<Arm> arms_;
  std::vector<double> side_;  // of each arm: 1 left, -1 right, 0 for a single arm
  std::vector<int> bodies_;   // objects of the task
  // Poses of `bodies_` at the time when a gripper first closed. Empty before that.
  std::vector<Eigen::Isometry3d> start_;
  // wrong_: whether the flaw is active. wrong_time_us_: time of the tick at which it became active.
  bool wrong_ = false;
  int64_t wrong_time_us_ = 0;
  action_t last_{};  // action that is repeated: by kStop the last one, by kCollide the first one
  std::vector<JointVector> shifted_;  // each arm's last joint targets of Shift()
  // State that is passed to the policy if it differs from the real state.
  state_t seen_{};
};

}  // namespace evalbus::policy
