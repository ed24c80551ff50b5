#include "policy_bridge/actions/gripper.h"

#include <fmt/format.h>

#include <cmath>

#include "base/errors.h"

namespace evalbus::policy {

double ClosingOf(const GripperForm& form, double value) {
  return (value - form.open) / (form.closed - form.open);
}

double ValueOf(const GripperForm& form, double closing) {
  return form.open + closing * (form.closed - form.open);
}

GripperCommand::GripperCommand(const GripperForm& form) : form_(form) {
  if (!std::isfinite(form.open) || !std::isfinite(form.closed) || form.open == form.closed) {
    throw InputError(
        fmt::format("gripper: expected two different, finite numbers for open and closed, got {} and {}",
                    form.open, form.closed));
  }
  if (form.threshold && !(*form.threshold >= 0 && *form.threshold < 1)) {
    throw InputError(fmt::format(
        "gripper: expected a threshold of the closed fraction from 0 to below 1, got {}", *form.threshold));
  }
  if (form.sticky_steps < 1) {
    throw InputError(fmt::format("gripper: expected at least 1 sticky step, got {}", form.sticky_steps));
  }
  if (form.sticky_steps > 1 && !form.threshold)
    throw InputError("gripper: more than 1 sticky step requires a threshold");
}

void GripperCommand::Begin() {
  is_closed_ = false;
  wanted_ = 0;
}

double GripperCommand::Step(double value) {
  const double closing = ClosingOf(form_, value);
  if (!form_.threshold) return closing;
  const bool wants_closed = closing > *form_.threshold;
  wanted_ = wants_closed == is_closed_ ? 0 : wanted_ + 1;
  if (wanted_ == form_.sticky_steps) {
    is_closed_ = wants_closed;
    wanted_ = 0;
  }
  return is_closed_ ? 1 : 0;
}

}  // namespace evalbus::policy
