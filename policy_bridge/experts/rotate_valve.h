// Scripted expert for RotateValve: each hand takes the hand wheel on its side. Both turn at once, or one
// after the other if the hands would collide.
#pragma once

#include <array>
#include <optional>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class RotateValveExpert : public Expert {
 public:
  // Throws InputError unless the model has the bodies first_valve/wheel and second_valve/wheel on hinges.
  RotateValveExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Extends `plan`: the arms take and turn wheels, release them and go home. `moving`: the arms whose
  // contacts are checked, including those with each other.
  static Plan TurnWheels(const Plan& plan, const std::vector<Hold>& holds, const std::vector<int>& moving);
  // Grasps with which the arm can take and turn a wheel alone; at most `count`.
  std::vector<Hold> Holds(const Plan& plan, int arm, int wheel, const std::vector<int>& moving,
                          size_t count) const;
  // Extends `plan`: each arm turns one wheel, both at once.
  std::optional<Plan> TurnBoth(const Plan& plan, const std::array<int, 2>& wheel_of_arm) const;

  // Bodies of the two wheels.
  std::array<int, 2> wheels_;
};

}  // namespace evalbus::policy
