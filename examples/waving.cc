// Example of a custom policy without a server: each arm swings its last joint about its initial position.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "base/plugins.h"
#include "evalbus/model_info_t.hpp"
#include "policy_bridge/factory.h"

namespace {

using namespace evalbus;

class Waving : public policy::Policy {
 public:
  explicit Waving(const model_info_t& info) : info_(info) {}
  void Begin(const episode_begin_t&) override { begin_ = {}; }
  void Act(const state_t& state, action_t* action) override {
    if (begin_.arm.empty()) begin_ = state;
    constexpr double kAmplitude_rad = 0.3, kPeriod_s = 2;
    const double time_s = static_cast<double>(state.header.sim_time_us) * 1e-6;
    action->mode = action_t::JOINT_POSITION;
    action->joint_position_rad.clear();
    for (size_t i = 0; i < begin_.arm.size(); ++i) {
      std::vector<double> joints = begin_.arm[i].joint_position_rad;
      joints.back() =
          std::clamp(joints.back() + kAmplitude_rad * std::sin(2 * std::numbers::pi * time_s / kPeriod_s),
                     info_.arm[i].joint_lower_rad.back(), info_.arm[i].joint_upper_rad.back());
      action->joint_position_rad.insert(action->joint_position_rad.end(), joints.begin(), joints.end());
    }
    action->num_joints = static_cast<int32_t>(action->joint_position_rad.size());
    action->num_grippers = static_cast<int32_t>(info_.gripper.size());
    action->gripper_closing.assign(info_.gripper.size(), 0);  // open
  }

 private:
  model_info_t info_;
  state_t begin_;
};

}  // namespace

EVALBUS_PLUGIN {
  policy::RegisterPolicy(
      "waving", "swings each arm's last joint about its initial position",
      [](const mjModel&, const model_info_t& info) { return std::make_unique<Waving>(info); });
}
