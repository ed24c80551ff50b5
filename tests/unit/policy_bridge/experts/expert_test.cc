// Tests the LiftPot expert in the simulated world.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "policy_bridge/factory.h"
#include "policy_bridge/policies/delayed_policy.h"
#include "policy_bridge/remote/latency.h"
#include "sim/world.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::expert_test {

constexpr double kTimeLimit = 18;  // s

struct Outcome {
  bool success = false;
  bool stages[4] = {};
  double time = 0;
  // Highest joint speed as a fraction of the joint's limit, and number of the robot's contacts other than
  // contacts of pads with the pot or with each other, and of a grasping palm with the pot.
  double speed = 0;
  int stray_contacts = 0;
  int64_t clips = 0;
  std::vector<std::vector<double>> actions;
};

// Runs until success or the time limit, and evaluates the episode with MuJoCo's own contacts.
Outcome Play(Policy* policy, const Variation& variation, int64_t seed, int hz = 50) {
  const PolicyScene& scene = GetPolicyScene();
  const model_info_t& info = scene.info();
  sim::World world(&scene.model(), info, scene.robot, scene.task, 500 / hz);
  world.Reset(seed, variation);
  episode_begin_t begin{};
  begin.seed = seed;
  policy->Begin(begin);

  std::set<int> pads[2];
  for (int i = 0; i < 2; ++i)
    pads[i].insert(info.gripper[i].pad_geom.begin(), info.gripper[i].pad_geom.end());
  const int pot = mj_name2id(&scene.model(), mjOBJ_BODY, "pot");
  const auto kind = [&](int geom) { return info.entity_kind[info.body_entity[info.geom_body[geom]]]; };

  Outcome outcome;
  state_t state{};
  action_t action{};
  for (int64_t tick = 0;; ++tick) {
    world.Fill(&state);
    state.header.tick = tick;
    state.header.sim_time_us = tick * world.tick_us();
    outcome.time = static_cast<double>(state.header.sim_time_us) * 1e-6;

    bool holds[2] = {}, on_counter = false;
    for (int i = 0; i < world.data().ncon; ++i) {
      int a = world.data().contact[i].geom1, b = world.data().contact[i].geom2;
      if (kind(b) == model_info_t::ROBOT) std::swap(a, b);
      const bool is_pad = pads[0].contains(a) || pads[1].contains(a);
      const bool pads_meet = is_pad && (pads[0].contains(b) || pads[1].contains(b));
      // The palm of a hand that has grasped may touch the handle between the hand's fingers.
      const std::string geom = mj_id2name(&scene.model(), mjOBJ_GEOM, a);
      const bool is_grasping_palm =
          (geom == "left/hand/hand" && outcome.stages[0]) || (geom == "right/hand/hand" && outcome.stages[1]);
      if (kind(b) == model_info_t::OBJECT && is_grasping_palm) continue;
      if (kind(b) == model_info_t::OBJECT && is_pad) {
        holds[pads[0].contains(a) ? 0 : 1] = true;
      } else if (kind(a) == model_info_t::ROBOT && !pads_meet) {
        ++outcome.stray_contacts;
      } else if (kind(a) == model_info_t::OBJECT || kind(b) == model_info_t::OBJECT) {
        on_counter = true;
      }
    }
    const double height = state.body[pot].position_m[2];
    const auto& q = state.body[pot].quat_wxyz;
    const double up_y = 2 * (q[2] * q[3] - q[0] * q[1]), up_z = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
    const bool level = up_z >= 0 && std::abs(std::asin(up_y)) <= 20 * std::numbers::pi / 180;
    outcome.stages[0] |= holds[0];
    outcome.stages[1] |= holds[1];
    outcome.stages[2] |= height >= 1.096;
    outcome.stages[3] |= height >= 1.096 && level && holds[0] && holds[1];
    outcome.success = height >= 1.096 && level && !on_counter;
    for (const arm_state_t& arm : state.arm) {
      for (int j = 0; j < arm.num_joints; ++j) {
        outcome.speed =
            std::max(outcome.speed, std::abs(arm.joint_velocity_radps[j]) / (j < 4 ? 2.175 : 2.61));
      }
    }
    outcome.clips = state.action_clips;
    if (outcome.success || outcome.time > kTimeLimit) return outcome;

    policy->Act(state, &action);
    const std::string fault = world.Apply(action);
    if (!fault.empty() || !world.Step()) {
      ADD_FAILURE() << fault << world.instability();
      return outcome;
    }
    outcome.actions.push_back(action.joint_position_rad);
  }
}

Outcome Play(Policy* policy, const std::string& variation, int64_t seed, int hz = 50) {
  return Play(policy, GetPolicyScene().task.variation(variation), seed, hz);
}

void ExpectGood(const Outcome& outcome) {
  EXPECT_TRUE(outcome.success);
  for (const bool stage : outcome.stages) EXPECT_TRUE(stage);
  EXPECT_LT(outcome.time, 18);
  EXPECT_LT(outcome.speed, 0.8);
  EXPECT_EQ(outcome.stray_contacts, 0);
  EXPECT_EQ(outcome.clips, 0);
}

std::unique_ptr<Policy> Make(const std::string& name) {
  return MakePolicy(name, GetPolicyScene().model(), GetPolicyScene().info());
}

TEST(LiftPotExpert, SucceedsOnEachVariation) {
  const auto expert = Make("expert");
  for (const char* variation : {"base", "position", "orientation", "position_and_orientation"}) {
    for (const int64_t seed : {3, 4, 5}) {
      SCOPED_TRACE(variation + std::string(", seed ") + std::to_string(seed));
      ExpectGood(Play(expert.get(), variation, seed));
    }
  }
}

// At tick 0 the grippers are still closed. The expert must not plan yet, because all actions of the first
// chunk are computed from this state.
TEST(LiftPotExpert, SucceedsWithAnInferenceDelay) {
  model_info_t info = GetPolicyScene().info();
  info.substeps = 10;  // 50 Hz
  for (const char* delay_ms : {"0", "200"}) {
    SCOPED_TRACE(delay_ms);
    DelayedPolicy delayed(Make("expert"), ParseLatency(delay_ms), info);
    EXPECT_TRUE(Play(&delayed, "position", 3).success);
  }
}

TEST(LiftPotExpert, DragsWhatIsOutOfReach) {
  const auto expert = Make("expert");
  // The pot may be anywhere on the counter. The task's own variations use a part of it within reach.
  Variation variation = GetPolicyScene().task.variation("position_and_orientation");
  std::get<SpawnBox>(variation.randomizations[0]).half_extents = {0.21, 0.4};
  for (const int64_t seed : {32, 49}) {
    SCOPED_TRACE(seed);
    const Outcome outcome = Play(expert.get(), variation, seed);
    ExpectGood(outcome);
    EXPECT_GT(outcome.time, 8);
  }
}

TEST(LiftPotExpert, WorksAtAnyControlRate) {
  const auto expert = Make("expert");
  for (const int hz : {20, 500}) {
    SCOPED_TRACE(hz);
    ExpectGood(Play(expert.get(), "position_and_orientation", 8, hz));
  }
}

TEST(LiftPotExpert, EqualSeedsGiveEqualActionsWhateverCameBefore) {
  const auto expert = Make("expert");
  const Outcome first = Play(expert.get(), "position", 6);
  Play(expert.get(), "position", 7);
  EXPECT_EQ(first.actions, Play(expert.get(), "position", 6).actions);
  EXPECT_EQ(first.actions, Play(Make("expert").get(), "position", 6).actions);
}

TEST(LiftPotExpert, TargetsAreAFunctionOfTime) {
  // The same state is received 20 and 500 times per second.
  const PolicyScene& scene = GetPolicyScene();
  sim::World world(&scene.model(), scene.info(), scene.robot, scene.task, 1);
  world.Reset(1, scene.task.variation("base"));
  state_t state{};
  world.Fill(&state);
  // The hands are closed initially, and this blocks every plan.
  for (const std::string hand : {"left/hand/", "right/hand/"}) {
    for (const std::string finger : {"finger_joint1", "finger_joint2"}) {
      const int joint = mj_name2id(&scene.model(), mjOBJ_JOINT, (hand + finger).c_str());
      state.qpos_mixed[static_cast<size_t>(scene.model().jnt_qposadr[joint])] = 0.04;
    }
  }
  const auto slow = Make("expert"), fast = Make("expert");
  slow->Begin({});
  fast->Begin({});
  action_t slow_action{}, fast_action{};
  for (int64_t time_us = 0; time_us <= 3'000'000; time_us += 2'000) {
    state.header.sim_time_us = time_us;
    fast->Act(state, &fast_action);
    if (time_us % 50'000) continue;
    slow->Act(state, &slow_action);
    EXPECT_EQ(slow_action.joint_position_rad, fast_action.joint_position_rad);
    EXPECT_EQ(slow_action.gripper_closing, fast_action.gripper_closing);
  }
}

TEST(NoisyExpert, DependsOnTheSeedAlone) {
  const auto noisy = Make("noisy_expert");
  const Outcome first = Play(noisy.get(), "base", 2);
  EXPECT_EQ(first.clips, 0);
  const Outcome other = Play(noisy.get(), "base", 4);
  EXPECT_NE(first.actions, other.actions);
  EXPECT_EQ(first.actions, Play(noisy.get(), "base", 2).actions);
}

}  // namespace evalbus::policy::expert_test
