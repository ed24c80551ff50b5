// A plugin whose policies violate the rules for plugins.
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/plugins.h"
#include "evalbus/model_info_t.hpp"
#include "policy_bridge/factory.h"

namespace {

using namespace evalbus;

// Holds the robot at home as docs/extending.md shows it, and calls `misbehave` at tick 5 of episode 1.
class BadPolicy : public policy::Policy {
 public:
  using Misbehave = std::function<void(action_t*)>;

  BadPolicy(const model_info_t& info, Misbehave misbehave) : info_(info), misbehave_(std::move(misbehave)) {}
  void Begin(const episode_begin_t&) override {}
  void Act(const state_t& state, action_t* action) override {
    action->mode = action_t::JOINT_POSITION;
    action->joint_position_rad.clear();
    for (const arm_info_t& arm : info_.arm) {
      action->joint_position_rad.insert(action->joint_position_rad.end(), arm.joint_home_rad.begin(),
                                        arm.joint_home_rad.end());
    }
    action->num_joints = static_cast<int32_t>(action->joint_position_rad.size());
    action->num_grippers = static_cast<int32_t>(info_.gripper.size());
    action->gripper_closing.assign(info_.gripper.size(), 0);
    if (state.header.episode == 1 && state.header.tick == 5) misbehave_(action);
  }

 private:
  model_info_t info_;
  Misbehave misbehave_;
};

void Register(const std::string& name, const BadPolicy::Misbehave& misbehave) {
  policy::RegisterPolicy(name, "misbehaves at tick 5 of episode 1",
                         [misbehave](const mjModel&, const model_info_t& info) {
                           return std::make_unique<BadPolicy>(info, misbehave);
                         });
}

}  // namespace

EVALBUS_PLUGIN {
  Register("throws", [](action_t*) { throw std::runtime_error("no grasp found"); });
  Register("throws_a_number", [](action_t*) { throw 7; });
  Register("says_more_joints_than_it_has", [](action_t* action) { action->num_joints = 1'000'000; });
  Register("says_fewer_grippers_than_it_has", [](action_t* action) { action->num_grippers = 1; });
  Register("exits", [](action_t*) { std::exit(0); });
  policy::RegisterPolicy("missing", "returns no policy", [](const mjModel&, const model_info_t&) {
    return std::unique_ptr<policy::Policy>();
  });
}
