#include "policy_bridge/actions/action_converter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/random.h"
#include "policy_bridge/actions/rotation.h"
#include "policy_bridge/planning/ik.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::action_converter_test {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
const double kHalf = std::sqrt(0.5);
constexpr int kJoints = 7;
constexpr double kStep = 0.05;  // s
// distance from the flange to the point between the pads
constexpr double kGripOffset = 0.1029;  // m

const mjModel& Model() { return GetPolicyScene().model(); }
const model_info_t& Info() { return GetPolicyScene().info(); }

std::vector<int> Counting(int first, int count) {
  std::vector<int> numbers;
  for (int i = 0; i < count; ++i) numbers.push_back(first + i);
  return numbers;
}

// RoboEval's action has 7 and 7 joints, followed by two grippers.
ActionSpace JointSpace(ActionKind kind) {
  ActionSpace space;
  space.kind = kind;
  space.num_values = 16;
  for (int i = 0; i < 2; ++i) {
    GripperForm gripper{.index = 14 + i, .open = 0, .closed = 1, .threshold = 0.5};
    space.arms.push_back({Info().arm[i].name, Counting(7 * i, 7), gripper});
  }
  return space;
}

// The action has one arm and no gripper, and consists of a position and a rotation.
ActionSpace EefSpace(ActionKind kind, ActionFrame frame = ActionFrame::kWorld,
                     EefPoint point = EefPoint::kFlange,
                     RotationForm rotation = RotationForm::kQuaternionWxyz) {
  ActionSpace space;
  space.kind = kind;
  space.frame = frame;
  space.point = point;
  space.rotation = rotation;
  space.num_values = 3 + NumValues(rotation);
  space.arms.push_back({"left", Counting(0, space.num_values), {}});
  return space;
}

JointVector Home(int arm = 0) { return HomeConfiguration(Info()).joints[arm]; }

state_t StateAt(const std::vector<JointVector>& joints) {
  state_t state{};
  for (const JointVector& q : joints) {
    arm_state_t arm{};
    arm.num_joints = static_cast<int32_t>(q.size());
    arm.joint_position_rad.assign(q.begin(), q.end());
    state.arm.push_back(arm);
  }
  state.num_arms = static_cast<int32_t>(joints.size());
  return state;
}

state_t HomeState() { return StateAt({Home(0), Home(1)}); }

// A converter during its episode, with the latest action.
struct Play {
  explicit Play(const ActionSpace& space, const mjModel& model = Model())
      : converter(space, model, Info()), chain(model, Info().arm[0]) {
    converter.Begin();
  }
  const action_t& Step(const std::vector<double>& row, const state_t& state = HomeState()) {
    converter.Convert(row, state, kStep, &action);
    return action;
  }
  JointVector Joints(int arm = 0) const {
    return Eigen::Map<const Eigen::VectorXd>(action.joint_position_rad.data() + kJoints * arm, kJoints);
  }
  Isometry3d Flange() const { return chain.Forward(Joints()); }

  ActionConverter converter;
  ArmChain chain;
  action_t action{};
};

void ExpectPose(const Isometry3d& pose, const Vector3d& position, const Matrix3d& rotation) {
  EXPECT_LT((pose.translation() - position).norm(), 2e-6)
      << pose.translation().transpose() << ", expected " << position.transpose();
  EXPECT_LT((pose.linear() - rotation).norm(), 4e-6) << pose.linear() << "\nexpected\n" << rotation;
}

Matrix3d Turn(double angle, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

// The pose of the flange at home, from the Panda's Denavit-Hartenberg table. The flange is 0.0825 + 0.384 +
// 0.088 m in front of the base and 0.333 + 0.316 + 0.0825 - 0.107 m above it; the base is at (0.1, 0.3, 0.6).
// The flange's z axis points down, and its x axis is rotated by 45 degrees about it (joint 7).
const Vector3d kBase(0.1, 0.3, 0.6);
const Vector3d kFlangeInBase(0.5545, 0, 0.6245);
// The lengths of all links in sequence are d1, d3, a4, a5 and d5, a7, and the flange.
const double kArmLength = 0.333 + 0.316 + 0.0825 + std::hypot(0.0825, 0.384) + 0.088 + 0.107;
Matrix3d FlangeRotation() {
  Matrix3d rotation;
  rotation << kHalf, kHalf, 0, kHalf, -kHalf, 0, 0, 0, -1;
  return rotation;
}

TEST(JointPosition, GoesToItsArmAsItIs) {
  Play play(JointSpace(ActionKind::kJointPosition));
  std::vector<double> row;
  for (int i = 0; i < 14; ++i) row.push_back(0.1 * i);
  row.push_back(0.4);
  row.push_back(0.6);
  play.Step(row);
  EXPECT_EQ(play.action.mode, action_t::JOINT_POSITION);
  EXPECT_EQ(play.action.num_joints, 14);
  EXPECT_EQ(play.action.num_grippers, 2);
  EXPECT_EQ(play.action.joint_position_rad, std::vector<double>(row.begin(), row.begin() + 14));
  EXPECT_EQ(play.action.gripper_closing, (std::vector<double>{0, 1}));
  EXPECT_EQ(play.action.unreachable_poses, 0);
  EXPECT_EQ(play.action.singular_poses, 0);
}

// The action has only the right arm, with its values reversed and after another value. The left arm is held
// at home.
TEST(JointPosition, IndicesPickAndTheOtherArmStaysAtHome) {
  ActionSpace space;
  space.num_values = 9;
  space.arms.push_back({"right", {7, 6, 5, 4, 3, 2, 1}, {.index = 8, .open = -1, .closed = 1}});
  Play play(space);
  play.Step({99, 1, 2, 3, 4, 5, 6, 7, 0});
  EXPECT_EQ(play.Joints(0), Home(0));
  EXPECT_EQ(play.Joints(1), (JointVector(7) << 7, 6, 5, 4, 3, 2, 1).finished());
  EXPECT_EQ(play.action.gripper_closing, (std::vector<double>{0, 0.5}));
}

TEST(JointPosition, ScaleThenOffsetThenClip) {
  ActionSpace space = JointSpace(ActionKind::kJointPosition);
  space.scale.assign(16, 1);
  space.offset.assign(16, 0);
  space.lower.assign(16, -std::numeric_limits<double>::infinity());
  space.upper.assign(16, std::numeric_limits<double>::infinity());
  space.scale[1] = 2;
  space.offset[1] = -0.5;
  space.upper[2] = 0.3;
  space.lower[3] = -0.4;
  space.scale[14] = -1;
  space.offset[14] = 1;
  Play play(space);
  std::vector<double> row(16, 0.0);
  row[1] = 0.4;
  row[2] = 1;
  row[3] = -1;
  play.Step(row);
  EXPECT_NEAR(play.Joints()[1], 0.3, 1e-12);
  EXPECT_EQ(play.Joints()[2], 0.3);
  EXPECT_EQ(play.Joints()[3], -0.4);
  EXPECT_EQ(play.action.gripper_closing, (std::vector<double>{1, 0}));
}

// The first delta is added to the measured position, and later deltas to the control target, although the arm
// lags behind.
TEST(JointDelta, OnTheTarget) {
  Play play(JointSpace(ActionKind::kJointDelta));
  state_t state = HomeState();
  state.arm[0].joint_position_rad[0] = 0.25;
  std::vector<double> row(16, 0.0);
  row[0] = 0.1;
  row[8] = -0.2;
  play.Step(row, state);
  EXPECT_NEAR(play.Joints(0)[0], 0.35, 1e-12);
  EXPECT_NEAR(play.Joints(1)[1], -0.2, 1e-12);
  play.Step(row);
  EXPECT_NEAR(play.Joints(0)[0], 0.45, 1e-12);
  EXPECT_NEAR(play.Joints(1)[1], -0.4, 1e-12);
  EXPECT_EQ(play.Joints(0)[3], Home()[3]);
  play.converter.Begin();
  play.Step(row);
  EXPECT_NEAR(play.Joints(0)[0], 0.1, 1e-12);
}

TEST(JointDelta, OnTheMeasurement) {
  ActionSpace space = JointSpace(ActionKind::kJointDelta);
  space.delta_on = DeltaOn::kMeasured;
  Play play(space);
  state_t state = HomeState();
  std::vector<double> row(16, 0.0);
  row[0] = 0.1;
  play.Step(row, state);
  state.arm[0].joint_position_rad[0] = 0.04;
  play.Step(row, state);
  EXPECT_NEAR(play.Joints()[0], 0.14, 1e-12);
}

// The limit of joint 1 is 2.8973 rad. A target beyond it is passed on, so that the sim clips and counts it,
// but it is not accumulated.
TEST(JointDelta, DoesNotWindUpAtALimit) {
  Play play(JointSpace(ActionKind::kJointDelta));
  std::vector<double> row(16, 0.0);
  row[0] = 2;
  const double expected[] = {2, 4, 4.8973, 4.8973};
  for (double joint : expected) {
    play.Step(row);
    EXPECT_NEAR(play.Joints()[0], joint, 1e-9);
  }
  row[0] = -0.5;
  play.Step(row);
  EXPECT_NEAR(play.Joints()[0], 2.3973, 1e-9);
}

// The velocity is 1 rad/s for 50 ms.
TEST(JointVelocity, IsHeldForTheStep) {
  Play play(JointSpace(ActionKind::kJointVelocity));
  std::vector<double> row(16, 0.0);
  row[6] = 1;
  play.Step(row);
  EXPECT_NEAR(play.Joints()[6], Home()[6] + 0.05, 1e-12);
  play.Step(row);
  EXPECT_NEAR(play.Joints()[6], Home()[6] + 0.1, 1e-12);
}

// In DROID's normalized velocities, 1 is 0.2 rad in a step of 15 Hz, added to the measured position.
TEST(JointVelocity, OfDroid) {
  ActionSpace space = JointSpace(ActionKind::kJointVelocity);
  space.delta_on = DeltaOn::kMeasured;
  space.scale.assign(16, 0.2 * 15);
  space.lower.assign(16, -3);
  space.upper.assign(16, 3);
  Play play(space);
  std::vector<double> row(16, 0.0);
  row[0] = 0.5;
  row[1] = 1.7;
  action_t action{};
  play.converter.Convert(row, HomeState(), 1.0 / 15, &action);
  play.converter.Convert(row, HomeState(), 1.0 / 15, &action);
  EXPECT_NEAR(action.joint_position_rad[0], 0.1, 1e-12);
  EXPECT_NEAR(action.joint_position_rad[1], 0.2, 1e-12);
}

// The pose is 5 cm in front of home and 10 cm lower, rotated so that the flange's x axis points forward.
TEST(EefPose, FlangeInTheWorld) {
  Play play(EefSpace(ActionKind::kEefPose));
  play.Step({0.7045, 0.3, 1.1245, 0, 1, 0, 0});
  Matrix3d down = Vector3d(1, -1, -1).asDiagonal();
  ExpectPose(play.Flange(), {0.7045, 0.3, 1.1245}, down);
  EXPECT_EQ(play.action.unreachable_poses, 0);
  EXPECT_EQ(play.action.singular_poses, 0);
  EXPECT_EQ(play.Joints(1), Home(1));
}

TEST(EefPose, WhatTheFlangeIsAtHomeKeepsTheArmThere) {
  Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kBase));
  const Eigen::Quaterniond q(FlangeRotation());
  play.Step({0.5545, 0, 0.6245, q.w(), q.x(), q.y(), q.z()});
  EXPECT_LT((play.Joints() - Home()).norm(), 1e-5);
}

// RoboEval's convention uses the base frame with extrinsic Euler angles. Pointing down is half a turn about
// x.
TEST(EefPose, FlangeInTheBaseWithEulerAngles) {
  Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kBase, EefPoint::kFlange,
                     RotationForm::kEulerXyzExtrinsic));
  play.Step({0.5, 0.1, 0.5, kPi, 0, kPi / 2});
  ExpectPose(play.Flange(), kBase + Vector3d(0.5, 0.1, 0.5),
             Turn(kPi / 2, Vector3d::UnitZ()) * Turn(kPi, Vector3d::UnitX()));
}

// z points down, so the point between the pads is below the flange. At home the closing direction is forward,
// so the grip's own x axis points to the left.
TEST(EefPose, GripInTheWorld) {
  Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kWorld, EefPoint::kGrip));
  // x points to the left (y), y forward (x) and z down, which is half a turn about (1, 1, 0).
  play.Step({0.6, 0.25, 1, 0, kHalf, kHalf, 0});
  EXPECT_LT((play.Flange().translation() - Vector3d(0.6, 0.25, 1 + kGripOffset)).norm(), 2e-4);
  EXPECT_LT((play.Flange().linear() - FlangeRotation()).norm(), 4e-6);
  const std::vector<Arm> arms = MakeArms(Model(), Info());
  EXPECT_LT((arms[0].GripPose(play.Joints()).translation() - Vector3d(0.6, 0.25, 1)).norm(), 2e-6);
}

TEST(EefPose, WithoutARotationKeepsTheFirstOrientation) {
  Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kWorld, EefPoint::kFlange, RotationForm::kNone));
  // The pose is out of reach, which changes the orientation. Afterwards, the first orientation returns.
  play.Step({3, 0.3, 1});
  EXPECT_EQ(play.action.unreachable_poses, 1);
  play.Step({0.6, 0.2, 1.1});
  play.Step({0.6, 0.2, 1.1});
  ExpectPose(play.Flange(), {0.6, 0.2, 1.1}, FlangeRotation());
}

struct DeltaCase {
  ActionFrame frame;
  Vector3d position, turn;  // in the action
  Vector3d moved;           // expected for the flange, world frame
  Matrix3d rotation;        // expected for the flange
};

// At home, the flange's x axis is (1, 1, 0) / sqrt 2 in the world, and its z axis points down.
TEST(EefDelta, FlangeInEachFrame) {
  const Vector3d z = Vector3d::UnitZ();
  const DeltaCase cases[] = {
      {ActionFrame::kWorld, {0.02, 0, 0.01}, {0, 0, 0.1}, {0.02, 0, 0.01}, Turn(0.1, z) * FlangeRotation()},
      {ActionFrame::kBase, {0.02, 0, 0.01}, {0, 0, 0.1}, {0.02, 0, 0.01}, Turn(0.1, z) * FlangeRotation()},
      {ActionFrame::kWrist,
       {0.02, 0, 0.01},
       {0, 0, 0.1},
       {0.02 * kHalf, 0.02 * kHalf, -0.01},
       Turn(-0.1, z) * FlangeRotation()},
      // The rotation is about the flange's own x axis.
      {ActionFrame::kWrist,
       {0, 0, 0},
       {0.2, 0, 0},
       {0, 0, 0},
       Turn(0.2, {kHalf, kHalf, 0}) * FlangeRotation()},
      {ActionFrame::kWorld, {0, 0, 0}, {0.2, 0, 0}, {0, 0, 0}, Turn(0.2, {1, 0, 0}) * FlangeRotation()},
  };
  for (const DeltaCase& row : cases) {
    SCOPED_TRACE(static_cast<int>(row.frame));
    Play play(EefSpace(ActionKind::kEefDelta, row.frame, EefPoint::kFlange, RotationForm::kAxisAngle));
    play.Step(
        {row.position.x(), row.position.y(), row.position.z(), row.turn.x(), row.turn.y(), row.turn.z()});
    ExpectPose(play.Flange(), kBase + kFlangeInBase + row.moved, row.rotation);
  }
}

// The left arm's mount is rotated by 90 degrees, so its x axis is the world's y axis.
TEST(EefFrames, BaseThatIsTurned) {
  const ModelPtr model(mj_copyModel(nullptr, &Model()));
  const int link0 = BodyId(*model, "left/link0");
  const double quat[] = {kHalf, 0, 0, kHalf};
  mju_copy4(model->body_quat + 4 * link0, quat);
  const Matrix3d quarter = Turn(kPi / 2, Vector3d::UnitZ());
  ExpectPose(BasePose(*model, Info().arm[0]), kBase, quarter);
  const Vector3d home = kBase + Vector3d(0, 0.5545, 0.6245);

  Play pose(EefSpace(ActionKind::kEefPose, ActionFrame::kBase, EefPoint::kFlange, RotationForm::kAxisAngle),
            *model);
  pose.Step({0.5, 0.1, 0.6, kPi, 0, 0});
  ExpectPose(pose.Flange(), kBase + Vector3d(-0.1, 0.5, 0.6), quarter * Turn(kPi, Vector3d::UnitX()));

  Play delta(EefSpace(ActionKind::kEefDelta, ActionFrame::kBase, EefPoint::kFlange, RotationForm::kAxisAngle),
             *model);
  delta.Step({0.03, 0, 0, 0.1, 0, 0});
  ExpectPose(delta.Flange(), home + Vector3d(0, 0.03, 0),
             Turn(0.1, Vector3d::UnitY()) * quarter * FlangeRotation());

  Play world(
      EefSpace(ActionKind::kEefDelta, ActionFrame::kWorld, EefPoint::kFlange, RotationForm::kAxisAngle),
      *model);
  world.Step({0.03, 0, 0, 0.1, 0, 0});
  ExpectPose(world.Flange(), home + Vector3d(0.03, 0, 0),
             Turn(0.1, Vector3d::UnitX()) * quarter * FlangeRotation());
}

// A rotation about the grip leaves the grip in place and moves the flange, which is above it.
TEST(EefDelta, TurnsAboutTheGrip) {
  Play play(EefSpace(ActionKind::kEefDelta, ActionFrame::kWorld, EefPoint::kGrip, RotationForm::kAxisAngle));
  const double angle = 0.3;
  play.Step({0, 0, 0, angle, 0, 0});
  const Vector3d swing(0, -kGripOffset * std::sin(angle), kGripOffset * (std::cos(angle) - 1));
  EXPECT_LT((play.Flange().translation() - kBase - kFlangeInBase - swing).norm(), 1e-4);
  EXPECT_LT((play.Flange().linear() - Turn(angle, Vector3d::UnitX()) * FlangeRotation()).norm(), 4e-6);
  // In the grip's own frame, whose x axis points to the left at home, this axis is y.
  Play own(EefSpace(ActionKind::kEefDelta, ActionFrame::kWrist, EefPoint::kGrip, RotationForm::kAxisAngle));
  own.Step({0, 0, 0, 0, angle, 0});
  EXPECT_LT((own.Flange().matrix() - play.Flange().matrix()).norm(), 1e-4);
}

// In RoboEval's convention, deltas are relative to the forward kinematics of the control target, however far
// the arm lags behind.
TEST(EefDelta, OnTheTargetAndOnTheMeasurement) {
  state_t lagging = HomeState();
  lagging.arm[0].joint_position_rad[0] = 0.3;
  const std::vector<double> row = {0.01, 0, 0, 0, 0, 0};
  ActionSpace space = EefSpace(ActionKind::kEefDelta, ActionFrame::kWorld, EefPoint::kFlange,
                               RotationForm::kEulerXyzExtrinsic);
  Play target(space);
  target.Step(row);
  target.Step(row, lagging);
  ExpectPose(target.Flange(), kBase + kFlangeInBase + Vector3d(0.02, 0, 0), FlangeRotation());

  space.delta_on = DeltaOn::kMeasured;
  Play measured(space);
  measured.Step(row);
  measured.Step(row, lagging);
  const Matrix3d turned = Turn(0.3, Vector3d::UnitZ());
  ExpectPose(measured.Flange(), kBase + turned * kFlangeInBase + Vector3d(0.01, 0, 0),
             turned * FlangeRotation());
}

TEST(EefDelta, EachOfAnUnchangedPoseKeepsTheTarget) {
  Play play(
      EefSpace(ActionKind::kEefDelta, ActionFrame::kWrist, EefPoint::kFlange, RotationForm::kRotation6d));
  for (int i = 0; i < 100; ++i) play.Step({0, 0, 0, 1, 0, 0, 0, 1, 0});
  EXPECT_LT((play.Joints() - Home()).norm(), 1e-12);
}

double Cost(const ArmChain& chain, const JointVector& q, const Isometry3d& target) {
  return PoseDifference(chain.Forward(q), target).squaredNorm();
}

// The cost is the sum of squares of meters and radians. It is compared with the cost of many random
// configurations, near and far.
TEST(Unreachable, GoesToTheNearestPoseAndStaysThere) {
  Random random(4, 0);
  const Vector3d positions[] = {{2.5, 0.3, 1.2}, {0.6, 0.3, 3}, {0.95, 0.3, 1.5}, {0.1, 3, 1}, {30, 5, 1}};
  for (const Vector3d& position : positions) {
    SCOPED_TRACE(position.transpose());
    Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kWorld, EefPoint::kFlange, RotationForm::kNone));
    const std::vector<double> row(position.begin(), position.end());
    for (int i = 0; i < 20; ++i) {
      play.Step(row);
      EXPECT_EQ(play.action.unreachable_poses, 1);
    }
    const JointVector q = play.Joints();
    EXPECT_TRUE((q.array() >= play.chain.lower().array()).all());
    EXPECT_TRUE((q.array() <= play.chain.upper().array()).all());
    play.Step(row);
    EXPECT_LT((play.Joints() - q).norm(), 0.01);

    Isometry3d wanted = Isometry3d::Identity();
    // The position is moved into the reach of the arm.
    const Vector3d away = position - kBase;
    wanted.translation() = kBase + away * std::min(1.0, kArmLength / away.norm());
    wanted.linear() = FlangeRotation();
    const double cost = Cost(play.chain, q, wanted);
    for (int i = 0; i < 20000; ++i) {
      const double size = std::pow(10, random.Uniform(-3, 0.5));
      JointVector other = q;
      for (double& joint : other) joint += random.Uniform(-size, size);
      other = other.cwiseMax(play.chain.lower()).cwiseMin(play.chain.upper());
      // No sample is closer by more than a hundredth of the distance.
      ASSERT_GT(Cost(play.chain, other, wanted), cost * 0.98) << "at " << size << " rad";
    }
  }
}

TEST(Unreachable, NumbersWithoutBoundsKeepTheArmDefined) {
  for (double size : {1e3, 1e9, 1e100, 1e300}) {
    Play play(EefSpace(ActionKind::kEefPose));
    play.Step({-size, size, size, 1, 0, 0, 0});
    EXPECT_TRUE(play.Joints().allFinite());
    EXPECT_EQ(play.action.unreachable_poses, 1);
    EXPECT_GT(play.Flange().translation().z(), 1.2) << "it points there";
    Play delta(EefSpace(ActionKind::kEefDelta));
    for (int i = 0; i < 3; ++i) {
      delta.Step({-size, size, size, 1, 0, 0, 0});
      EXPECT_TRUE(delta.Joints().allFinite());
    }
  }
}

// The middle pose stretches the arm very far. A search for the first pose that begins there ends with the
// elbow at its limit, 0.2 m away.
TEST(Unreachable, APoseWithinReachIsReachedAgainAfterwards) {
  Play play(EefSpace(ActionKind::kEefPose, ActionFrame::kBase, EefPoint::kFlange, RotationForm::kNone));
  play.Step({0.5, 0, 0.5});
  const Isometry3d first = play.Flange();
  EXPECT_EQ(play.Step({2, 0, 0.5}).unreachable_poses, 1);
  EXPECT_FALSE(SolveIk(play.chain, first, play.Joints()).converged);
  EXPECT_EQ(play.Step({0.5, 0, 0.5}).unreachable_poses, 0);
  EXPECT_LT((play.Flange().matrix() - first.matrix()).norm(), 1e-6);
}

TEST(Unreachable, EachArmIsCounted) {
  ActionSpace space =
      EefSpace(ActionKind::kEefPose, ActionFrame::kBase, EefPoint::kFlange, RotationForm::kNone);
  space.num_values = 6;
  space.arms.push_back({"right", {3, 4, 5}, {}});
  Play play(space);
  EXPECT_EQ(play.Step({0.5, 0, 0.5, 0.5, 0, 0.5}).unreachable_poses, 0);
  EXPECT_EQ(play.Step({0.5, 0, 0.5, 2, 0, 0.5}).unreachable_poses, 1);
  EXPECT_EQ(play.Step({2, 0, 0.5, 2, 0, 0.5}).unreachable_poses, 2);
  EXPECT_EQ(play.Step({0.5, 0, 0.5, 0.5, 0, 0.5}).unreachable_poses, 0);
}

// For a diagonal Jacobian, the condition number is the quotient of the largest and the smallest entry. With
// fewer than six joints, only directions count in which they can move.
TEST(Singular, ConditionNumber) {
  Jacobian jacobian = Jacobian::Zero(6, 7);
  const double diagonal[] = {1, 2, 0.5, 4, 1, 1};
  for (int i = 0; i < 6; ++i) jacobian(i, i) = diagonal[i];
  EXPECT_NEAR(ConditionNumber(jacobian), 8, 1e-9);
  jacobian(2, 2) = 0;
  EXPECT_GT(ConditionNumber(jacobian), 1e6);
  Jacobian two = Jacobian::Zero(6, 2);
  two(0, 0) = 3;
  two(5, 1) = 1;
  EXPECT_NEAR(ConditionNumber(two), 3, 1e-9);
}

// A nearly straight arm is singular, but an arm at home is not. Its previous motion does not matter.
TEST(Singular, AStraightArmIsCounted) {
  ActionSpace space = EefSpace(ActionKind::kEefPose);
  Play play(space);
  JointVector straight = Home();
  straight[3] = -0.08;
  const Configuration from{{straight, Home(1)}, {0, 0}}, home{{Home(), Home(1)}, {0, 0}};
  play.Step(play.converter.RowOf(from, from, kStep), StateAt({straight, Home(1)}));
  EXPECT_EQ(play.action.singular_poses, 1);
  EXPECT_EQ(play.action.unreachable_poses, 0);
  for (int i = 0; i < 5; ++i) play.Step(play.converter.RowOf(home, home, kStep));
  EXPECT_EQ(play.action.singular_poses, 0);
  EXPECT_EQ(play.action.unreachable_poses, 0);
}

std::string SpaceError(const ActionSpace& space) {
  try {
    ActionConverter converter(space, Model(), Info());
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

std::string SpaceError(ActionSpace space, const std::function<void(ActionSpace*)>& change) {
  change(&space);
  return SpaceError(space);
}

TEST(ActionSpaceErrors, AreNamed) {
  const ActionSpace joints = JointSpace(ActionKind::kJointPosition);
  const ActionSpace eef = EefSpace(ActionKind::kEefDelta);
  using Space = ActionSpace;
  EXPECT_EQ(SpaceError(joints), "none");
  EXPECT_EQ(SpaceError(eef), "none");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].arm = "leftt"; }),
            "action: the robot has no arm 'leftt'; did you mean 'left'?");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].arm = "third"; }),
            "action: the robot has no arm 'third'; expected one of left, right");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[1].arm = "left"; }),
            "action: arm 'left' is given twice");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms.clear(); }), "action: no arm uses any of its values");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[1].indices[2] = 16; }),
            "action: arm 'right': index 16; a row has the values 0 to 15");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[1].indices[2] = -1; }),
            "action: arm 'right': index -1; a row has the values 0 to 15");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[1].indices[2] = 3; }),
            "action: arm 'right': value 3 is used twice");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].gripper.index = 16; }),
            "action: arm 'left': index 16; a row has the values 0 to 15");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].gripper.index = 3; }),
            "action: arm 'left': the gripper's value 3 is also used by an arm");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].gripper.index = 15; }), "none");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].gripper.open = 1; }),
            "gripper: expected two different, finite numbers for open and closed, got 1 and 1");
  EXPECT_EQ(SpaceError(joints, [](Space* s) { s->arms[0].indices.pop_back(); }),
            "action: arm 'left': 6 indices; joint_position takes 7, one for each joint");
  EXPECT_EQ(SpaceError(eef, [](Space* s) { s->rotation = RotationForm::kAxisAngle; }),
            "action: arm 'left': 7 indices; eef_delta takes 6, 3 for the position and 3 for the rotation");
  EXPECT_EQ(
      SpaceError(eef,
                 [](Space* s) {
                   s->kind = ActionKind::kEefPose;
                   s->frame = ActionFrame::kWrist;
                 }),
      "action: an eef_pose must be in the world or base frame; only an eef_delta can be in the wrist frame");
  EXPECT_EQ(SpaceError(eef,
                       [](Space* s) {
                         s->scale = {1, 2};
                       }),
            "action: scale has 2 numbers, but a row has 7 values");
  EXPECT_EQ(SpaceError(eef, [](Space* s) { s->upper.assign(7, std::nan("")); }),
            "action: value 0: expected lower <= upper, got -inf and nan");
  EXPECT_EQ(SpaceError(eef,
                       [](Space* s) {
                         s->lower.assign(7, 1);
                         s->upper.assign(7, -1);
                       }),
            "action: value 0: expected lower <= upper, got 1 and -1");
  EXPECT_EQ(SpaceError(eef, [](Space* s) { s->offset.assign(7, std::nan("")); }),
            "action: scale and offset must be finite");
}

std::string RowError(const ActionSpace& space, const std::vector<double>& row,
                     const state_t& state = HomeState()) {
  Play play(space);
  try {
    play.Step(row, state);
  } catch (const InputError&) {
    return "an input error";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

TEST(ActionRowErrors, AreNamed) {
  ActionSpace joints = JointSpace(ActionKind::kJointDelta);
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  std::vector<double> row(16, 0.0);
  EXPECT_EQ(RowError(joints, row), "none");
  row[9] = nan;
  EXPECT_EQ(RowError(joints, row),
            "value 9 of the policy's action, for arm 'right', is nan; expected a finite number");
  row[9] = 0;
  row[14] = -inf;
  EXPECT_EQ(
      RowError(joints, row),
      "value 14 of the policy's action, for the gripper of arm 'left', is -inf; expected a finite number");
  // The value is refused even if it would be clipped. It is accepted if it is not used.
  joints.lower.assign(16, -1);
  EXPECT_EQ(
      RowError(joints, row),
      "value 14 of the policy's action, for the gripper of arm 'left', is -inf; expected a finite number");
  joints.arms[0].gripper.index.reset();
  EXPECT_EQ(RowError(joints, row), "none");
  row.pop_back();
  EXPECT_EQ(RowError(joints, row), "the policy's action has 15 values, expected 16");

  const ActionSpace eef = EefSpace(ActionKind::kEefPose);
  EXPECT_EQ(RowError(eef, {0.5, 0, 1, 0, 0, 0, 0}),
            "values 3, 4, 5, 6 of the policy's action, for arm 'left': (0, 0, 0, 0) is not a rotation: the "
            "norm of the quaternion is below 1e-6");
  EXPECT_EQ(RowError(eef, {0.5, inf, 1, 1, 0, 0, 0}),
            "value 1 of the policy's action, for arm 'left', is inf; expected a finite number");

  EXPECT_EQ(RowError(eef, {0.5, 0, 1, 1, 0, 0, 0}, StateAt({Home()})), "the state has 1 arms, the model 2");
  EXPECT_EQ(RowError(eef, {0.5, 0, 1, 1, 0, 0, 0}, StateAt({JointVector::Zero(6), Home()})),
            "the state has 6 joints of arm 'left', the model 7");
}

TEST(ActionConverter, BeginForgetsTheGrippers) {
  ActionSpace space = JointSpace(ActionKind::kJointDelta);
  space.arms[0].gripper.sticky_steps = 2;
  Play play(space);
  std::vector<double> row(16, 0.0);
  row[14] = 1;
  play.Step(row);
  play.Step(row);
  EXPECT_EQ(play.action.gripper_closing[0], 1);
  play.converter.Begin();
  play.Step(row);
  EXPECT_EQ(play.action.gripper_closing[0], 0);
}

std::vector<double> WanderingRow(int step) {
  return {0.6545 + 0.3 * std::sin(0.1 * step),
          0.3 + 0.3 * std::sin(0.07 * step),
          1.1 + 0.4 * std::sin(0.05 * step),
          0.3 * std::sin(0.03 * step),
          1,
          0.2 * std::sin(0.02 * step),
          0};
}

TEST(ActionConverter, TwoOfThemPublishTheSameBits) {
  const ActionSpace space = EefSpace(ActionKind::kEefPose);
  Play a(space), b(space);
  // The second converter has already run a different episode.
  b.Step({0.4, 0.5, 1, 1, 0, 0, 0});
  b.converter.Begin();
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(a.Step(WanderingRow(i)).joint_position_rad, b.Step(WanderingRow(i)).joint_position_rad);
    EXPECT_EQ(a.action.unreachable_poses, b.action.unreachable_poses);
  }
}

TEST(ActionConverter, AllocatesNothingOnceItRuns) {
  Play play(EefSpace(ActionKind::kEefPose));
  const state_t state = HomeState();
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < 50; ++i) rows.push_back(WanderingRow(i));
  play.converter.Convert(rows[0], state, kStep, &play.action);
  const int64_t before = AllocationCount();
  for (const std::vector<double>& row : rows) play.converter.Convert(row, state, kStep, &play.action);
  EXPECT_EQ(AllocationCount() - before, 0);
}

// Covers the joint kinds with scales and linear grippers. round_trip_test.cc covers the rest.
TEST(ActionConverter, RowOfIsTheOtherDirection) {
  Random random(5, 0);
  const auto near_home = [&](int arm) {
    JointVector q = Home(arm);
    for (double& joint : q) joint += random.Uniform(-0.3, 0.3);
    return q;
  };
  for (ActionKind kind : {ActionKind::kJointPosition, ActionKind::kJointDelta, ActionKind::kJointVelocity}) {
    ActionSpace space = JointSpace(kind);
    space.scale.assign(16, 0.5);
    space.offset.assign(16, 0.25);
    for (ArmForm& arm : space.arms) arm.gripper = {.index = arm.gripper.index, .open = 3, .closed = -1};
    Play play(space);
    const Configuration from{{near_home(0), near_home(1)}, {0, 0}},
        to{{near_home(0), near_home(1)}, {0.25, 1}};
    play.Step(play.converter.RowOf(from, to, kStep), StateAt(from.joints));
    EXPECT_LT((play.Joints(0) - to.joints[0]).norm() + (play.Joints(1) - to.joints[1]).norm(), 1e-12);
    EXPECT_NEAR(play.action.gripper_closing[0], 0.25, 1e-12);
    EXPECT_NEAR(play.action.gripper_closing[1], 1, 1e-12);
  }
}

}  // namespace evalbus::policy::action_converter_test
