// Scripted expert for PackBox: each hand goes under the flap on its side, pushes it up and over, and presses
// it down; both at once, or one after the other where they would be in each other's way.
#pragma once

#include <array>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class PackBoxExpert : public Expert {
 public:
  // Throws InputError if the model has no bodies box/left_flap and box/right_flap on hinges.
  PackBoxExpert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // How an arm closes its flap: grip frames (world) above and beside the flap, and under its border.
  struct Way {
    Eigen::Isometry3d over, beside, under;
    Turning turning;
  };

  // All ways for the arm to close its flap, the most natural first, whether it can or not.
  std::vector<Way> Ways(const state_t& state, int arm);
  // Tries ways of the arm alone, from `start`, until it knows enough possible ones. False if that takes more
  // than this tick allows: to be called again at the next.
  bool Search(const Plan& start, const state_t& state, int arm);
  // `plan` and then: the hands go under the flaps in these ways.
  static Plan GoUnder(const Plan& plan, const std::vector<Way>& ways);
  // And then: they close the flaps and back off.
  static Plan CloseFlaps(const Plan& under, const std::vector<Way>& ways);

  // By arm: bodies, and what the search is about.
  std::array<int, 2> flaps_;
  std::array<bool, 2> searching_ = {};
  std::array<std::vector<Way>, 2> untried_, possible_;
};

}  // namespace evalbus::policy
