// Scripted expert for CubeHandover: one arm takes the rod at one end and brings it to the middle, the other
// arm takes it at the other end, and the first arm releases it.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class CubeHandoverExpert : public Expert {
 public:
  // Throws InputError if the model has no rod, or does not have two arms.
  CubeHandoverExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Extends `plan`: the giver takes the rod at an end (1: its +y, -1: its -y) and hands it over.
  std::optional<Plan> HandOver(const Plan& plan, int giver, double end) const;
  // Poses of the rod at which the other arm may take it, after the giver has lifted it by its end.
  std::vector<Eigen::Isometry3d> Meetings(const Eigen::Isometry3d& rod, int giver, double end) const;

  int rod_;
  // By arm: 1 if it stands on the left (+y), else -1.
  double side_[2];
};

}  // namespace evalbus::policy
