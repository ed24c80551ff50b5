// Scripted expert for PackBox: each hand goes under the flap on its side, pushes it up and over, and presses
// it down; both at once, or one after the other where they would be in each other's way.
#pragma once

#include <array>

#include "policy_bridge/expert.h"

namespace evalbus {

class PackBoxExpert : public Expert {
 public:
  // Throws InputError if the model has no bodies box/left_flap and box/right_flap on hinges.
  PackBoxExpert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // How an arm closes its flap: grip frames (world) above and beside the flap, and under its edge.
  struct Way {
    Eigen::Isometry3d over, beside, under;
    Turning turning;
  };

  // Ways for the arm to close its flap, alone and after `plan`; at most `count`.
  std::vector<Way> Ways(const Plan& plan, const state_t& state, int arm, size_t count);
  // `plan` and then: the hands close the flaps in these ways, and back off.
  static Plan CloseFlaps(const Plan& plan, const std::vector<Way>& ways);

  // Bodies, by arm.
  std::array<int, 2> flaps_;
  int attempts_ = 0;
};

}  // namespace evalbus
