// Conversion of a policy's gripper values.
#pragma once

#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

// Converts a policy's value to closing: 0 open, 1 closed. Linear, also beyond the two ends; the sim clips
// values that a gripper cannot reach and counts them.
double ClosingOf(const GripperForm& form, double value);
// Inverse of ClosingOf().
double ValueOf(const GripperForm& form, double closing);

// State of one gripper during an episode: applies the threshold and sticky_steps of the form.
class GripperCommand {
 public:
  // Throws InputError if open equals closed, if the threshold is not from 0 to less than 1, or if
  // sticky_steps is set without a threshold.
  explicit GripperCommand(const GripperForm& form);

  // Begins an episode: the gripper is open and no change is pending.
  void Begin();
  // Returns the closing after one more step with the policy's value `value`.
  double Step(double value);

 private:
  GripperForm form_;
  bool is_closed_ = false;
  // Number of consecutive steps that requested the other state.
  int wanted_ = 0;
};

}  // namespace evalbus::policy
