// Converts experts' episodes to every action space and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/planning/ik.h"
#include "tests/unit/policy_bridge/expert_play.h"

namespace evalbus::policy::round_trip_test {

constexpr int kHz = 50;
constexpr double kStep_s = 1.0 / kHz;

// The commands of an expert, tick by tick, and the states that it received.
struct Recorded {
  std::vector<state_t> states;
  std::vector<Configuration> commands;
};

Configuration ToConfiguration(const model_info_t& info, const action_t& action) {
  Configuration configuration;
  configuration.closing = action.gripper_closing;
  size_t next = 0;
  for (const arm_info_t& arm : info.arm) {
    configuration.joints.push_back(
        Eigen::Map<const Eigen::VectorXd>(action.joint_position_rad.data() + next, arm.num_joints));
    next += static_cast<size_t>(arm.num_joints);
  }
  return configuration;
}

Configuration Measured(const state_t& state) {
  Configuration configuration;
  for (const arm_state_t& arm : state.arm) {
    configuration.joints.push_back(
        Eigen::Map<const Eigen::VectorXd>(arm.joint_position_rad.data(), arm.num_joints));
  }
  return configuration;
}

// Returns a space with all arms, one after the other, followed by their grippers.
ActionSpace MakeSpace(const model_info_t& info, ActionKind kind, ActionFrame frame = ActionFrame::kWorld,
                      EefPoint point = EefPoint::kFlange,
                      RotationForm rotation = RotationForm::kQuaternionWxyz) {
  ActionSpace space;
  space.kind = kind;
  space.frame = frame;
  space.point = point;
  space.rotation = rotation;
  const bool is_eef = kind == ActionKind::kEefPose || kind == ActionKind::kEefDelta;
  for (const arm_info_t& arm : info.arm) {
    ArmForm form{arm.name, {}, {}};
    for (int i = 0; i < (is_eef ? 3 + NumValues(rotation) : arm.num_joints); ++i) {
      form.indices.push_back(space.num_values++);
    }
    space.arms.push_back(form);
  }
  for (ArmForm& form : space.arms) form.gripper.index = space.num_values++;
  return space;
}

// Deviation after converting a recording to an action space and back.
struct Deviation {
  double position = 0, rotation = 0;  // of a wrist, m and rad
  double joint = 0;                   // rad
  int unreachable = 0, singular = 0;
};

Deviation RoundTripOf(const Scene& scene, const Recorded& recorded, const ActionSpace& space) {
  const model_info_t& info = scene.info;
  ActionConverter converter(space, *scene.physics, info);
  converter.Begin();
  std::vector<ArmChain> chains;
  for (const arm_info_t& arm : info.arm) chains.emplace_back(*scene.physics, arm);
  Deviation deviation;
  Configuration last = Measured(recorded.states[0]);
  action_t action{};
  for (size_t tick = 0; tick < recorded.commands.size(); ++tick) {
    const state_t& state = recorded.states[tick];
    const Configuration& command = recorded.commands[tick];
    const Configuration from = space.delta_on == DeltaOn::kTarget ? last : Measured(state);
    converter.Convert(converter.RowOf(from, command, kStep_s), state, kStep_s, &action);
    const Configuration back = ToConfiguration(info, action);
    for (size_t i = 0; i < chains.size(); ++i) {
      const auto difference =
          PoseDifference(chains[i].Forward(back.joints[i]), chains[i].Forward(command.joints[i]));
      deviation.position = std::max(deviation.position, difference.head<3>().norm());
      deviation.rotation = std::max(deviation.rotation, difference.tail<3>().norm());
      deviation.joint = std::max(deviation.joint, (back.joints[i] - command.joints[i]).cwiseAbs().maxCoeff());
      EXPECT_NEAR(back.closing[i], command.closing[i], 1e-12);
    }
    deviation.unreachable += action.unreachable_poses;
    deviation.singular += action.singular_poses;
    last = command;
  }
  return deviation;
}

// Converts each of the expert's actions to a row of the action space, and back to an action.
class Through {
 public:
  Through(const Scene& scene, const ActionSpace& space)
      : info_(scene.info), converter_(space, *scene.physics, scene.info) {
    converter_.Begin();
  }
  void operator()(const state_t& state, action_t* action) {
    if (last_.joints.empty()) last_ = Measured(state);
    const Configuration from = converter_.space().delta_on == DeltaOn::kTarget ? last_ : Measured(state);
    converter_.Convert(converter_.RowOf(from, ToConfiguration(info_, *action), kStep_s), state, kStep_s,
                       action);
    last_ = ToConfiguration(info_, *action);
  }

 private:
  const model_info_t& info_;
  ActionConverter converter_;
  Configuration last_;
};

Recorded Record(ExpertStage* stage) {
  Recorded recorded;
  const PlayedEpisode played = stage->Play(1, kHz, [&](const state_t& state, action_t* action) {
    recorded.states.push_back(state);
    recorded.commands.push_back(ToConfiguration(stage->scene().info, *action));
  });
  EXPECT_EQ(played.verdict, metrics::Verdict::kSuccess);
  return recorded;
}

// Allowed deviations of each absolute pose and, for deltas, of the sum over a run. Near the identity,
// robosuite's form of deltas loses the last half of its digits.
constexpr double kPoseTolerance = 1e-8;                                 // m, and rad
constexpr double kPositionTolerance = 2e-7, kRotationTolerance = 1e-6;  // of deltas, m and rad

class ExpertRuns : public testing::TestWithParam<const char*> {};

// Joints are not compared for eef kinds, because an arm with a redundant joint has several solutions.
TEST_P(ExpertRuns, ComeBackFromEverySpace) {
  ExpertStage stage(GetParam());
  const Scene& scene = stage.scene();
  const Recorded recorded = Record(&stage);
  ASSERT_FALSE(recorded.commands.empty());
  for (ActionKind kind : {ActionKind::kJointPosition, ActionKind::kJointDelta, ActionKind::kJointVelocity}) {
    for (DeltaOn delta_on : {DeltaOn::kTarget, DeltaOn::kMeasured}) {
      ActionSpace space = MakeSpace(scene.info, kind);
      space.delta_on = delta_on;
      EXPECT_LT(RoundTripOf(scene, recorded, space).joint, 1e-12) << NameOf(kind);
    }
  }
  const auto expect_within = [&](const ActionSpace& space, double position, double rotation) {
    const Deviation deviation = RoundTripOf(scene, recorded, space);
    SCOPED_TRACE(std::string(NameOf(space.kind)) + ", frame " +
                 std::to_string(static_cast<int>(space.frame)) + ", point " +
                 std::to_string(static_cast<int>(space.point)) + ", rotation " +
                 std::to_string(static_cast<int>(space.rotation)));
    EXPECT_LT(deviation.position, position);
    EXPECT_LT(deviation.rotation, rotation);
    EXPECT_EQ(deviation.unreachable, 0);
    EXPECT_EQ(deviation.singular, 0);
  };
  for (EefPoint point : {EefPoint::kFlange, EefPoint::kGrip}) {
    for (const auto& [name, rotation] : kRotationForms) {
      if (rotation == RotationForm::kNone) continue;
      for (ActionFrame frame : {ActionFrame::kWorld, ActionFrame::kBase}) {
        expect_within(MakeSpace(scene.info, ActionKind::kEefPose, frame, point, rotation), kPoseTolerance,
                      kPoseTolerance);
      }
      for (ActionFrame frame : {ActionFrame::kWorld, ActionFrame::kBase, ActionFrame::kWrist}) {
        for (DeltaOn delta_on : {DeltaOn::kTarget, DeltaOn::kMeasured}) {
          ActionSpace space = MakeSpace(scene.info, ActionKind::kEefDelta, frame, point, rotation);
          space.delta_on = delta_on;
          expect_within(space, kPositionTolerance, kRotationTolerance);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Tasks, ExpertRuns, testing::Values("lift_pot", "cube_handover", "rotate_valve"),
                         [](const auto& task) { return std::string(task.param); });

// The physics receives the converted actions, and the task's own conditions give the verdict.
TEST(ExpertThrough, SucceedsOnLiftPot) {
  ExpertStage stage("lift_pot");
  const model_info_t& info = stage.scene().info;
  ActionSpace delta_on_measured = MakeSpace(info, ActionKind::kJointDelta);
  delta_on_measured.delta_on = DeltaOn::kMeasured;
  const ActionSpace spaces[] = {
      MakeSpace(info, ActionKind::kJointDelta),
      delta_on_measured,
      MakeSpace(info, ActionKind::kJointVelocity),
      MakeSpace(info, ActionKind::kEefPose, ActionFrame::kBase, EefPoint::kFlange,
                RotationForm::kEulerXyzExtrinsic),
      MakeSpace(info, ActionKind::kEefPose, ActionFrame::kWorld, EefPoint::kGrip, RotationForm::kRotation6d),
      MakeSpace(info, ActionKind::kEefDelta, ActionFrame::kWorld, EefPoint::kFlange,
                RotationForm::kAxisAngle),
      MakeSpace(info, ActionKind::kEefDelta, ActionFrame::kWrist, EefPoint::kGrip,
                RotationForm::kQuaternionXyzw),
  };
  for (const ActionSpace& space : spaces) {
    SCOPED_TRACE(NameOf(space.kind));
    Through through(stage.scene(), space);
    const PlayedEpisode played = stage.Play(1, kHz, std::ref(through));
    EXPECT_EQ(played.verdict, metrics::Verdict::kSuccess);
    EXPECT_EQ(played.clips, 0);
    EXPECT_EQ(played.stray_contacts, 0) << played.stray;
  }
}

}  // namespace evalbus::policy::round_trip_test
