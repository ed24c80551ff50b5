// Scripted expert for LiftPot: both hands grasp a handle of the pot, lift it and hold it level. Where the pot
// stands out of reach of both arms at once, one hand first drags it nearer.
#pragma once

#include <optional>

#include "policy_bridge/expert.h"

namespace evalbus {

class LiftPotExpert : public Expert {
 public:
  // Throws InputError if the model has no pot with the sites left_handle and right_handle.
  LiftPotExpert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // How a hand takes a handle: grip frames in the pot's frame, before and at the grasp.
  struct Grasp {
    Eigen::Isometry3d before, at;
  };

  // Ways to take a handle, the most upright first.
  std::vector<Grasp> Grasps(int handle) const;
  // True if the arm can take and raise the pot so, following `plan`.
  bool CanTake(const Plan& plan, int arm, const Eigen::Isometry3d& pot, const Grasp& grasp) const;
  // `plan` and then: both hands lift the pot from where it stands. Nothing if that is impossible.
  std::optional<Plan> Lift(const Plan& plan, const Eigen::Isometry3d& pot) const;
  // `plan` and then: one hand drags the pot to where Lift is possible.
  std::optional<Plan> Drag(const Plan& plan, const Eigen::Isometry3d& pot) const;

  int pot_body_;
  // Middle of the handles' bars in the pot's frame, left and right; m.
  Eigen::Vector3d handles_[2];
  int attempts_ = 0;
  // Height of the pot's origin at tick 0, m.
  double start_height_ = 0;
};

}  // namespace evalbus
