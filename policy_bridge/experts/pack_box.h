// Scripted expert for PackBox: each hand goes under the flap on its side, pushes it up and over, and presses
// it down. Both hands work at once, or one after the other if they would collide.
#pragma once

#include <array>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class PackBoxExpert : public Expert {
 public:
  // Throws InputError unless the model has the bodies box/left_flap and box/right_flap on hinges.
  PackBoxExpert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // How an arm closes its flap: grip frames (world frame) above and beside the flap, and under its edge.
  struct Way {
    Eigen::Isometry3d over, beside, under;
    Turning turning;
  };

  // All candidate ways for the arm to close its flap, the most natural first, feasible or not.
  std::vector<Way> Ways(const state_t& state, int arm);
  // Tries ways of this arm alone, from `start`, until enough feasible ones are known. Returns false if that
  // takes more effort than this tick allows; call it again at the next tick.
  bool Search(const Plan& start, const state_t& state, int arm);
  // Extends `plan`: the hands go under the flaps in these ways.
  static Plan GoUnder(const Plan& plan, const std::vector<Way>& ways);
  // Extends `under`: the hands close the flaps and move back.
  static Plan CloseFlaps(const Plan& under, const std::vector<Way>& ways);

  // By arm: bodies, and the state of the search.
  std::array<int, 2> flaps_;
  std::array<bool, 2> searching_ = {};
  std::array<std::vector<Way>, 2> untried_, possible_;
};

}  // namespace evalbus::policy
