// What policies say to grippers.
#pragma once

#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

// A policy's value as closing: 0 open, 1 closed. Linear, and beyond the ends where the value is: what a
// gripper cannot do the sim clips and counts.
double ClosingOf(const GripperForm& form, double value);
// The other way.
double ValueOf(const GripperForm& form, double closing);

// One gripper of a policy through an episode: thresholds, and waits as long as the form says.
class GripperCommand {
 public:
  // Throws InputError where open and closed are the same, the threshold is not from 0 to under 1, or steps
  // are to be waited for without one.
  explicit GripperCommand(const GripperForm& form);

  // An episode begins: open, and nothing waited for.
  void Begin();
  // Closing after one more step, at which the policy says `value`.
  double Step(double value);

 private:
  GripperForm form_;
  bool is_closed_ = false;
  // Steps in a row that wanted the other state.
  int wanted_ = 0;
};

}  // namespace evalbus::policy
