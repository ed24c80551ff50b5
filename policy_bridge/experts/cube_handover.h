// Scripted expert for CubeHandover: one arm takes the rod at an end and brings it to the middle, the other
// arm takes it at the other end, then the first lets go.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class CubeHandoverExpert : public Expert {
 public:
  // Throws InputError if the model has no rod or not two arms.
  CubeHandoverExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // `plan` and then: the giver takes the rod at an end (1: its +y, -1: its -y) and hands it over.
  std::optional<Plan> HandOver(const Plan& plan, int giver, double end) const;
  // Poses of the rod in which the other arm may take it, when the giver, who has its end, has lifted it.
  std::vector<Eigen::Isometry3d> Meetings(const Eigen::Isometry3d& rod, int giver, double end) const;

  int rod_;
  // Of each arm: 1 if it stands on the left (+y), else -1.
  double side_[2];
};

}  // namespace evalbus::policy
