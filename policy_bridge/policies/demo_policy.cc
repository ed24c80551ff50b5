#include "policy_bridge/policies/demo_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/text.h"
#include "lcmtypes/clock.h"

namespace evalbus::policy {

DemoPolicy::DemoPolicy(std::vector<std::filesystem::path> files, const model_info_t& info)
    : files_(std::move(files)), tick_s_(ControlPeriod(info)) {
  const bool fits = info.num_arms == 2 && info.num_grippers == 2 && info.arm[0].num_joints == 7 &&
                    info.arm[1].num_joints == 7;
  if (!fits)
    throw InputError("policy \"demo\": demonstrations require two arms with 7 joints and a gripper each");
}

void DemoPolicy::Begin(const episode_begin_t& begin) {
  const auto episode = static_cast<size_t>(begin.header.episode);
  if (episode >= files_.size()) {
    throw InputError(fmt::format("policy \"demo\": there {} {}, none for episode {}",
                                 files_.size() == 1 ? "is" : "are", Plural(files_.size(), "demonstration"),
                                 episode));
  }
  demo_ = ReadDemonstration(files_[episode]);
}

void DemoPolicy::Act(const state_t& state, action_t* action) {
  const size_t last = demo_.steps.size() - 1;
  const double begin = Seconds(state.header.sim_time_us) * demo_.hz;
  // Times of ticks are rounded to microseconds, so a tolerance of 1e-6 steps is added.
  const auto first = static_cast<size_t>(std::floor(begin + 1e-6));
  const auto end = std::max(first + 1, static_cast<size_t>(std::floor(begin + tick_s_ * demo_.hz + 1e-6)));
  action->mode = action_t::JOINT_POSITION;
  action->joint_position_rad.assign(kDemoJoints, 0);
  for (size_t step = first; step < end; ++step) {
    for (size_t j = 0; j < kDemoJoints; ++j)
      action->joint_position_rad[j] += demo_.steps[std::min(step, last)][j];
  }
  for (double& position : action->joint_position_rad) position /= static_cast<double>(end - first);
  action->num_joints = kDemoJoints;
  const auto& step = demo_.steps[std::min(end - 1, last)];
  action->gripper_closing = {step[kDemoJoints], step[kDemoJoints + 1]};
  for (double& closing : action->gripper_closing) closing = closing > 0.5;
  action->num_grippers = 2;
}

}  // namespace evalbus::policy
