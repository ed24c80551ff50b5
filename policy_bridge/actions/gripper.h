// Conversion of a policy's gripper values.
#pragma once

#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

// Converts a policy's value linearly to a closing: 0 open, 1 closed. The result may be outside [0, 1]; the
// sim clips such values and counts them.
double ClosingOf(const GripperForm& form, double value);
// Returns the inverse of ClosingOf().
double ValueOf(const GripperForm& form, double closing);

// Applies the threshold and sticky_steps of a form to the values of one gripper during an episode.
class GripperCommand {
 public:
  // Throws InputError if open and closed are equal or not finite, if the threshold is below 0 or at least 1,
  // or if sticky_steps is below 1, or above 1 without a threshold.
  explicit GripperCommand(const GripperForm& form);

  // Begins an episode: the gripper is open and no change is pending.
  void Begin();
  // Processes one step in which the policy returned `value`; returns the commanded closing.
  double Step(double value);

 private:
  GripperForm form_;
  bool is_closed_ = false;
  // Number of consecutive steps that requested the other state.
  int wanted_ = 0;
};

}  // namespace evalbus::policy
