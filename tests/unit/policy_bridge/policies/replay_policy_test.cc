#include "policy_bridge/policies/replay_policy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/errors.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy {
namespace {

const model_info_t& Info() { return GetPolicyScene().info(); }

state_t StateAt(int64_t time_us) {
  state_t state{};
  state.header.sim_time_us = time_us;
  return state;
}

action_t Recorded(int64_t tick, double first_joint) {
  action_t action{};
  action.header.tick = tick;
  action.header.sim_time_us = tick * 20'000;
  action.mode = action_t::JOINT_POSITION;
  action.num_joints = 14;
  action.joint_position_rad.assign(14, 0.0);
  action.joint_position_rad[0] = first_joint;
  action.num_grippers = 2;
  action.gripper_closing = {0, 1};
  return action;
}

TEST(ReplayPolicy, PlaysByTimeAndHoldsTheLast) {
  ReplayPolicy replay(
      [](int) {
        return std::vector<action_t>{Recorded(0, 0.1), Recorded(1, 0.2), Recorded(2, 0.3)};
      },
      Info());
  for (int episode = 0; episode < 2; ++episode) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    replay.Begin(begin);
    action_t action{};
    const auto first_joint = [&](int64_t time_us) {
      replay.Act(StateAt(time_us), &action);
      return action.joint_position_rad[0];
    };
    EXPECT_EQ(first_joint(0), 0.1);
    EXPECT_EQ(first_joint(10'000), 0.1);
    EXPECT_EQ(first_joint(20'000), 0.2);
    EXPECT_EQ(first_joint(60'000), 0.3);
    EXPECT_EQ(action.gripper_closing[1], 1);
  }
}

TEST(ReplayPolicy, RefusesWhatItCannotPlay) {
  episode_begin_t begin{};
  begin.header.episode = 5;
  ReplayPolicy empty([](int) { return std::vector<action_t>{}; }, Info());
  EXPECT_THROW(empty.Begin(begin), InputError);
  action_t wrong = Recorded(0, 0);
  wrong.joint_position_rad.pop_back();
  ReplayPolicy other([&](int) { return std::vector<action_t>{wrong}; }, Info());
  EXPECT_THROW(other.Begin(begin), InputError);
}

TEST(ReplayPolicy, NamesALogThatIsDamaged) {
  const std::filesystem::path log =
      std::filesystem::path(testing::TempDir()) / "replay_policy_damaged.lcmlog";
  std::ofstream(log) << "no events at all";
  try {
    OpenRecording(log)(0);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("damaged.lcmlog is damaged: 16 bytes"), std::string::npos)
        << error.what();
  }
  std::filesystem::remove(log);
}

}  // namespace
}  // namespace evalbus::policy
