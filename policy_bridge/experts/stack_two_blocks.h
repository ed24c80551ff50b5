// Scripted expert for StackTwoBlocks: puts one cube down in the middle and the other on top of it. Two arms
// take one cube each if both can. Otherwise the cubes are moved one after the other, each by an arm that
// reaches it.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class StackTwoBlocksExpert : public Expert {
 public:
  // Throws InputError unless the model has red_cube and blue_cube.
  StackTwoBlocksExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // A grasp with which the arm can take and lift the cube after `plan`.
  std::optional<Grasp> FindGrasp(const Plan& plan, int arm, int cube) const;
  // Extends `plan`: `lower_arm` puts one cube down in the middle while the other arm holds the other cube,
  // which it then puts on top. Nothing if that is impossible.
  std::optional<Plan> StackWithBoth(const Plan& plan, int lower_arm, int lower, int upper) const;
  // Extends `plan`: one cube is brought to the middle, then the other one is put on top of it.
  std::optional<Plan> StackInTurn(const Plan& plan, int lower, int upper) const;
  std::optional<Plan> PutOnTop(const Plan& plan, int lower, int upper) const;

  int cubes_[2];
};

}  // namespace evalbus::policy
