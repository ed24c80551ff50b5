#include "policy_bridge/policies/delayed_policy.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace evalbus::policy::delayed_policy_test {

// Commands 100 times the observed joint position plus the tick at which it is called.
class Tracer : public Policy {
 public:
  void Begin(const episode_begin_t&) override {}
  void Act(const state_t& state, action_t* action) override {
    EXPECT_TRUE(action->joint_position_rad.empty());
    EXPECT_EQ(state.header.sim_time_us, state.header.tick * 100'000);
    action->joint_position_rad = {100 * state.arm[0].joint_position_rad[0] +
                                  static_cast<double>(state.header.tick)};
    action->num_joints = 1;
  }
};

// Returns the commands at ticks 0, 1, ... of 100 ms. The joint position equals the tick.
std::vector<double> Play(const Latency& latency, int ticks, std::vector<policy_action_t>* answers) {
  model_info_t info{};
  info.timestep_us = 2000;
  info.substeps = 50;
  DelayedPolicy policy(std::make_unique<Tracer>(), latency, info);
  PolicyCallbacks callbacks;
  callbacks.on_policy_action = [&](const policy_action_t& m) { answers->push_back(m); };
  policy.SetCallbacks(callbacks);
  policy.Begin({});
  std::vector<double> commands;
  for (int tick = 0; tick < ticks; ++tick) {
    state_t state{};
    state.header.tick = tick;
    state.header.sim_time_us = tick * 100'000;
    state.arm.push_back({});
    state.arm[0].joint_position_rad = {static_cast<double>(tick)};
    action_t action{};
    policy.Act(state, &action);
    commands.push_back(action.joint_position_rad.at(0));
  }
  return commands;
}

// At 10 Hz, 5 actions of a chunk are executed, and 150 ms is rounded up to 2 ticks.
TEST(DelayedPolicy, SynchronousPausesThePolicysClock) {
  std::vector<policy_action_t> answers;
  EXPECT_EQ(Play({Latency::Kind::kFixed, 0.15}, 11, &answers),
            (std::vector<double>{0, 0, 0, 1, 2, 3, 4, 4, 4, 705, 706}));
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(answers[1].header.tick, 7);
  EXPECT_EQ(answers[1].held_ticks, 2);
  EXPECT_EQ(answers[1].execute_steps, 5);
  EXPECT_EQ(answers[1].num_steps, 0);
}

TEST(DelayedPolicy, AsynchronousGoesOnWithWhatItObservedBefore) {
  std::vector<policy_action_t> answers;
  EXPECT_EQ(Play({Latency::Kind::kFixed, 0.15, Execution::kAsynchronous}, 11, &answers),
            (std::vector<double>{0, 0, 0, 1, 2, 3, 4, 5, 6, 707, 708}));
  EXPECT_EQ(answers.at(1).header.tick, 7);
}

}  // namespace evalbus::policy::delayed_policy_test
