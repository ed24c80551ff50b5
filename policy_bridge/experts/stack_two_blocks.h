// Scripted expert for StackTwoBlocks: puts one cube down in the middle and the other on it. Two arms take a
// cube each where both can; otherwise one cube after the other is moved, by whichever arm reaches it.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class StackTwoBlocksExpert : public Expert {
 public:
  // Throws InputError if the model has no red_cube and blue_cube.
  StackTwoBlocksExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // How the arm can take a cube and lift it, following `plan`.
  std::optional<Grasp> FindGrasp(const Plan& plan, int arm, int cube) const;
  // `plan` and then: `lower_arm` puts a cube down in the middle, the other arm meanwhile holds the other cube
  // and then puts it on top. Nothing if that is impossible.
  std::optional<Plan> StackWithBoth(const Plan& plan, int lower_arm, int lower, int upper) const;
  // `plan` and then: one cube is brought to the middle, then the other one on top of it.
  std::optional<Plan> StackInTurn(const Plan& plan, int lower, int upper) const;
  std::optional<Plan> PutOnTop(const Plan& plan, int lower, int upper) const;

  int cubes_[2];
};

}  // namespace evalbus::policy
