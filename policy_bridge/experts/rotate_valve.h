// Scripted expert for RotateValve: each hand takes the hand-wheel on its side and both turn at once, or one
// after the other where the hands would be in each other's way.
#pragma once

#include <array>
#include <optional>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class RotateValveExpert : public Expert {
 public:
  // Throws InputError if the model has no bodies first_valve/wheel and second_valve/wheel on hinges.
  RotateValveExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // `plan` and then: arms take and turn wheels, let them go and come home. `moving`: the arms whose contacts
  // count, with each other too.
  static Plan TurnWheels(const Plan& plan, const std::vector<Hold>& holds, const std::vector<int>& moving);
  // Ways for the arm to take and turn a wheel alone; at most `count`.
  std::vector<Hold> Holds(const Plan& plan, int arm, int wheel, const std::vector<int>& moving,
                          size_t count) const;
  // `plan` and then: each arm turns one wheel, both at once.
  std::optional<Plan> TurnBoth(const Plan& plan, const std::array<int, 2>& wheel_of_arm) const;

  // Bodies.
  std::array<int, 2> wheels_;
};

}  // namespace evalbus::policy
