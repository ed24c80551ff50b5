#include "runner/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "base/errors.h"
#include "base/random.h"
#include "bus/wake_event.h"
#include "lcmtypes/clock.h"

namespace evalbus::runner::environment_test {

policy::Array Row(std::vector<double> values) {
  const auto size = static_cast<int64_t>(values.size());
  return policy::FloatArray(values, {size});
}

arm_info_t Arm(const std::string& name) {
  arm_info_t arm{};
  arm.name = name;
  arm.num_joints = 2;
  arm.joint_lower_rad = {-1, -2};
  arm.joint_upper_rad = {3, 4};
  return arm;
}

// Returns a model of two arms with two joints each, at 20 Hz. Only the second arm has a gripper.
model_info_t TwoArms() {
  model_info_t model{};
  model.arm = {Arm("a"), Arm("b")};
  model.num_arms = 2;
  gripper_info_t gripper{};
  gripper.arm = 1;
  model.gripper = {gripper};
  model.num_grippers = 1;
  model.timestep_us = 2000;
  model.substeps = 25;
  return model;
}

TEST(EnvironmentContract, HasTheValuesOfAllArmsThenThoseOfTheGrippers) {
  const policy::Contract joint = MakeContract({"joint", {"head"}, 32, 16}, 20, TwoArms());
  EXPECT_EQ(joint.rate_hz, 20);
  EXPECT_EQ(joint.actions.num_values, 5);
  ASSERT_EQ(joint.actions.arms.size(), 2u);
  EXPECT_EQ(joint.actions.arms[1].indices, (std::vector<int>{2, 3}));
  EXPECT_FALSE(joint.actions.arms[0].gripper.index);
  EXPECT_EQ(joint.actions.arms[1].gripper.index, 4);
  ASSERT_EQ(joint.observation.size(), 2u);
  EXPECT_EQ(joint.observation[0].signals.size(), 3u);
  EXPECT_EQ(joint.observation[1].KeyText(), "images.head");

  const policy::Contract eef = MakeContract({"eef_delta", {}, 32, 16}, 20, TwoArms());
  EXPECT_EQ(eef.actions.num_values, 13);
  EXPECT_EQ(eef.actions.rotation, policy::RotationForm::kEulerXyzExtrinsic);
  EXPECT_THROW(MakeContract({"levers", {}, 32, 16}, 20, TwoArms()), InputError);
}

TEST(EnvironmentContract, BoundsAreLimitsOrStepsOfATick) {
  const auto bounds = [](const char* control) {
    return BoundsOf(MakeContract({control, {}, 32, 16}, 20, TwoArms()).actions, TwoArms());
  };
  EXPECT_EQ(bounds("joint").lower, (std::vector<double>{-1, -2, -1, -2, 0}));
  EXPECT_EQ(bounds("joint").upper, (std::vector<double>{3, 4, 3, 4, 1}));
  // The bounds allow 2 rad/s and 0.5 m/s for 50 ms.
  EXPECT_EQ(bounds("joint_delta").upper, (std::vector<double>{0.1, 0.1, 0.1, 0.1, 1}));
  EXPECT_EQ(bounds("eef_delta").lower[0], -0.025);
  EXPECT_EQ(bounds("eef_delta").lower[3], -0.1);
  EXPECT_EQ(bounds("eef_delta").lower[12], 0);
}

TEST(StepExchange, PassesObservationsAndActionsBetweenThreads) {
  StepExchange exchange;
  WakeEvent observed;
  const auto client = exchange.MakeClient([&] { observed.Set(); });
  const auto wait = [&] {
    while (!exchange.is_waiting()) std::this_thread::yield();
  };
  policy::Reply reply;
  std::thread answered([&] { reply = client->Infer(policy::Map{{"state", 1}}); });
  wait();
  EXPECT_EQ(exchange.TakeObservation(), policy::Value(policy::Map{{"state", 1}}));
  EXPECT_FALSE(exchange.TakeObservation());
  exchange.Answer(7);
  EXPECT_FALSE(exchange.is_waiting());
  answered.join();
  EXPECT_EQ(reply.value, policy::Value(policy::Map{{"actions", 7}}));

  std::thread abandoned([&] { EXPECT_THROW(client->Infer(policy::Map()), policy::ServerError); });
  wait();
  exchange.Abandon();
  abandoned.join();
  EXPECT_FALSE(exchange.is_waiting());
}

TEST(Environment, RefusesAnUnknownCameraAtItsStart) {
  EnvironmentOptions options;
  options.sim.task = "lift_pot/position";
  options.sim.control_hz = 20;
  options.form.cameras = {"nose"};
  try {
    Environment environment(options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("no camera 'nose'; this scene has head, "))
        << error.what();
  }
}

TEST(Environment, EpisodesStartAsThoseOfARun) {
  EnvironmentOptions options;
  options.sim.task = "lift_pot/position";
  options.sim.control_hz = 20;
  Environment environment(options);
  const std::vector<double> home(16, 0.0);
  EXPECT_THROW(environment.Act(Row(home)), InputError);
  const Environment::Step first = environment.Reset(7, 3);
  EXPECT_EQ(first.scores["metrics"]["completion_time"], 0.0);
  EXPECT_TRUE(first.episode.is_null());
  EXPECT_THROW(environment.Act(Row({1, 2, 3})), InputError);
  environment.Act(Row(home));
  // The abandoned episode does not affect the next one.
  const Environment::Step again = environment.Reset(7, 3);
  EXPECT_EQ(again.observation, first.observation);
  EXPECT_EQ(again.scores, first.scores);

  const policy::Array state = *again.observation.Find("state")->As<policy::Array>();
  std::vector<double> hold = policy::Numbers(state);
  hold[14] = hold[15] = 0;  // open grippers
  Environment::Step step;
  int steps = 0;
  for (; step.episode.is_null(); ++steps) step = environment.Act(Row(hold));
  EXPECT_EQ(steps, std::lround(Seconds(environment.model().time_limit_us) * 20));
  EXPECT_EQ(step.episode["end_reason"], "time_limit");
  EXPECT_EQ(step.episode["seed"], (SeedSource{7, kRunSeeds, "lift_pot", "position"}.OfEpisode(3)));
  EXPECT_EQ(step.scores["metrics"], step.episode["metrics"]);
  EXPECT_THROW(environment.Act(Row(hold)), InputError);
}

}  // namespace evalbus::runner::environment_test
