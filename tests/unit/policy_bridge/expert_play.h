// Runs a scripted expert in the simulated world, with MuJoCo's contacts, and evaluates the episode with the
// task's own conditions.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metrics/task/task_evaluator.h"
#include "models/scene.h"
#include "policy_bridge/factory.h"
#include "sim/world.h"

namespace evalbus::policy {

struct PlayedEpisode {
  metrics::Verdict verdict = metrics::Verdict::kUndecided;
  std::vector<uint8_t> stage_reached;
  double time = 0;  // s, simulated
  // Highest joint speed as a fraction of the joint's limit.
  double speed = 0;
  int64_t clips = 0;
  // Number of ticks at which the robot had stray contacts, and the first such pair. Contacts of pads with
  // objects or with other pads are not stray.
  int stray_contacts = 0;
  std::string stray;
  std::vector<std::vector<double>> actions;
};

// A task in one of its variations, and its expert. Both are created once for many episodes.
class ExpertStage {
 public:
  // task: as FindTask() expects it. robot: a robot as FindRobot() expects it, which replaces the task's own;
  // its models are in `sources`.
  explicit ExpertStage(const std::string& task, const std::string& robot = "",
                       const ModelSources& sources = {})
      : selection_(FindTask(task)),
        robot_(LoadRobot(robot.empty() ? selection_.task.robot_file : FindRobot(robot), sources)),
        scene_(Compose(robot_, &selection_.task)),
        names_(scene_.info),
        evaluator_(selection_.task, names_),
        policy_(MakePolicy("expert", *scene_.physics, scene_.info)) {}

  const Scene& scene() const { return scene_; }

  // rewrite: changes each of the expert's actions before it is applied.
  PlayedEpisode Play(int64_t seed, int hz = 50,
                     const std::function<void(const state_t&, action_t*)>& rewrite = {}) {
    sim::World world(scene_.physics.get(), scene_.info, robot_, selection_.task, 500 / hz);
    world.Reset(seed, selection_.task.variation(selection_.variation));
    episode_begin_t begin{};
    begin.seed = seed;
    policy_->Begin(begin);
    evaluator_.Start();
    PlayedEpisode played;
    state_t state{};
    action_t action{};
    std::vector<contact_t> contacts;
    for (int64_t tick = 0;; ++tick) {
      world.Fill(&state);
      state.header.tick = tick;
      state.header.sim_time_us = tick * world.tick_us();
      played.time = static_cast<double>(state.header.sim_time_us) * 1e-6;
      LookAt(world.data(), &contacts, &played);
      for (const arm_state_t& arm : state.arm) {
        for (int j = 0; j < arm.num_joints; ++j) {
          played.speed =
              std::max(played.speed, std::abs(arm.joint_velocity_radps[j]) / (j < 4 ? 2.175 : 2.61));
        }
      }
      evaluator_.Evaluate({state, contacts}, tick);
      played.verdict = evaluator_.verdict();
      played.stage_reached = evaluator_.stage_reached();
      played.clips = state.action_clips;
      if (played.verdict != metrics::Verdict::kUndecided || played.time >= selection_.task.time_limit)
        return played;
      policy_->Act(state, &action);
      if (rewrite) rewrite(state, &action);
      const std::string fault = world.Apply(action);
      if (!fault.empty() || !world.Step()) {
        ADD_FAILURE() << fault << world.instability();
        return played;
      }
      played.actions.push_back(action.joint_position_rad);
    }
  }

  // Expects success with every stage reached except the optional one (counted from 1), within the speed
  // limits and without stray contacts.
  void ExpectSuccess(int64_t seed, int hz = 50, size_t optional_stage = 0) {
    SCOPED_TRACE(selection_.task.name + "/" + selection_.variation + ", seed " + std::to_string(seed));
    const PlayedEpisode played = Play(seed, hz);
    EXPECT_EQ(played.verdict, metrics::Verdict::kSuccess);
    for (size_t i = 0; i < played.stage_reached.size(); ++i) {
      if (i + 1 == optional_stage) continue;
      EXPECT_TRUE(played.stage_reached[i]) << "stage " << i + 1;
    }
    EXPECT_LT(played.speed, 0.8);
    EXPECT_EQ(played.clips, 0);
    EXPECT_EQ(played.stray_contacts, 0) << played.stray;
  }

 private:
  // Adapts the task to the robot.
  static Scene Compose(const RobotDescription& robot, TaskDescription* task) {
    task->ApplyRobot(robot.name, robot.arm_names());
    Scene scene = BuildScene(*task, robot);
    scene.info.substeps = 10;
    return scene;
  }

  void LookAt(const mjData& data, std::vector<contact_t>* contacts, PlayedEpisode* played) const {
    const model_info_t& info = scene_.info;
    const auto kind = [&](int geom) { return info.entity_kind[info.body_entity[info.geom_body[geom]]]; };
    const auto is_pad = [&](int geom) {
      return std::any_of(info.gripper.begin(), info.gripper.end(), [&](const gripper_info_t& gripper) {
        return std::count(gripper.pad_geom.begin(), gripper.pad_geom.end(), geom) > 0;
      });
    };
    contacts->clear();
    for (int i = 0; i < data.ncon; ++i) {
      const mjContact& contact = data.contact[i];
      int a = contact.geom1, b = contact.geom2;
      contacts->push_back({std::min(a, b), std::max(a, b), contact.dist, {}, {}});
      if (contact.dist > 0) continue;
      if (kind(b) == model_info_t::ROBOT) std::swap(a, b);
      if (kind(a) != model_info_t::ROBOT) continue;
      if (is_pad(a) && (kind(b) == model_info_t::OBJECT || is_pad(b))) continue;
      if (played->stray_contacts++ == 0) {
        played->stray =
            info.geom_name[a] + " and " + info.geom_name[b] + " at " + std::to_string(played->time) + " s";
      }
    }
  }

  TaskSelection selection_;
  RobotDescription robot_;
  Scene scene_;
  ModelNames names_;
  metrics::TaskEvaluator evaluator_;
  std::unique_ptr<Policy> policy_;
};

}  // namespace evalbus::policy
