#include "policy_bridge/policies/replay_policy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/errors.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::replay_policy_test {

const model_info_t& Info() {
  static const model_info_t info = [] {
    model_info_t at_50_Hz = GetPolicyScene().info();
    at_50_Hz.timestep_us = 2000;
    at_50_Hz.substeps = 10;
    return at_50_Hz;
  }();
  return info;
}

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

constexpr int64_t kSeed = 11;

RecordedActions Episode(const std::vector<action_t>& actions) {
  RecordedActions recorded{.log = "a.lcmlog", .episode = {}};
  recorded.episode.model = Info();
  recorded.episode.begin.emplace().seed = kSeed;
  recorded.episode.actions = actions;
  return recorded;
}

TEST(ReplayPolicy, PlaysByTimeAndHoldsTheLast) {
  ReplayPolicy replay(
      [](int) {
        return Episode({Recorded(0, 0.1), Recorded(1, 0.2), Recorded(2, 0.3)});
      },
      Info(), false);
  for (int episode = 0; episode < 2; ++episode) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    begin.seed = kSeed;
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
  begin.seed = kSeed;
  ReplayPolicy empty([](int) { return RecordedActions{}; }, Info(), true);
  EXPECT_THROW(empty.Begin(begin), InputError);
  action_t wrong = Recorded(0, 0);
  wrong.joint_position_rad.pop_back();
  ReplayPolicy other([&](int) { return Episode({wrong}); }, Info(), true);
  EXPECT_THROW(other.Begin(begin), InputError);
}

TEST(ReplayPolicy, RefusesAnotherSceneUnlessForced) {
  const auto refusal = [](const model_info_t& recorded, int64_t seed, bool anyway) -> std::string {
    RecordedActions episode = Episode({Recorded(0, 0)});
    episode.episode.model = recorded;
    ReplayPolicy replay([&](int) { return episode; }, Info(), anyway);
    episode_begin_t begin{};
    begin.seed = seed;
    try {
      replay.Begin(begin);
    } catch (const InputError& error) {
      return error.what();
    }
    return "plays";
  };
  EXPECT_EQ(refusal(Info(), kSeed, false), "plays");
  const auto expect = [&](const std::string& differences, const model_info_t& recorded,
                          int64_t seed = kSeed) {
    EXPECT_EQ(refusal(recorded, seed, false), "policy \"replay\": a.lcmlog was recorded with " + differences +
                                                  "; the same actions would have a different effect "
                                                  "(\"replay_anyway:...\" replays them regardless)");
    EXPECT_EQ(refusal(recorded, seed, true), "plays");
  };
  expect("episode seed 11, not 12", Info(), 12);
  model_info_t other = Info();
  other.task = "fold_towel";
  other.variation = "windy";
  expect("task fold_towel, not lift_pot; variation windy, not " + Info().variation, other);
  other = Info();
  other.robot = "other_robot";
  expect("robot other_robot, not " + Info().robot, other);
  other = Info();
  other.substeps *= 2;
  expect("control rate 25 Hz, not 50 Hz", other);
  other = Info();
  other.physics_sha256 = "0";
  expect("another physics model of the same task, variation and robot", other);
}

TEST(ReplayPolicy, NamesALogThatIsDamaged) {
  const std::filesystem::path log =
      std::filesystem::path(testing::TempDir()) / "replay_policy_damaged.lcmlog";
  std::ofstream(log) << "no events at all";
  try {
    OpenRecording(log)(0);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("damaged.lcmlog: damaged: 16 bytes cannot be read"),
              std::string::npos)
        << error.what();
  }
  std::filesystem::remove(log);
}

}  // namespace evalbus::policy::replay_policy_test
