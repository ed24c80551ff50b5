#include "policy_bridge/contract/signal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/errors.h"
#include "base/random.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::signal_test {

class SignalTest : public testing::Test {
 protected:
  SignalTest() {
    const mjModel& model = GetPolicyScene().model();
    state_.qpos_mixed.assign(static_cast<size_t>(model.nq), 0);
    state_.qvel_mixed.assign(static_cast<size_t>(model.nv), 0);
    for (int side = 0; side < 2; ++side) {
      arm_state_t arm{};
      for (int j = 0; j < 7; ++j) {
        arm.joint_position_rad.push_back(side + 0.1 * j);
        arm.joint_velocity_radps.push_back(-side - 0.1 * j);
      }
      arm.wrist_position_m[0] = 0.5;
      arm.wrist_position_m[1] = side == 0 ? 0.3 : -0.3;
      arm.wrist_position_m[2] = 1;
      // The orientation is a quarter turn about z.
      arm.wrist_quat_wxyz[0] = arm.wrist_quat_wxyz[3] = std::numbers::sqrt2 / 2;
      state_.arm.push_back(arm);
      state_.gripper.emplace_back().opening = 0.25 + 0.5 * side;
    }
    state_.body.resize(static_cast<size_t>(model.nbody));
  }

  std::vector<double> Read(const Signal& signal) {
    return SignalReader({signal}, GetPolicyScene().model(), GetPolicyScene().info()).Read(state_);
  }
  std::vector<double> Read(const std::string& name) {
    Signal signal;
    signal.name = name;
    return Read(signal);
  }
  static void ExpectNear(const std::vector<double>& values, const std::vector<double>& expected) {
    ASSERT_EQ(values.size(), expected.size());
    for (size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-12) << i;
  }

  state_t state_{};
};

TEST_F(SignalTest, JointsOfEachArm) {
  ExpectNear(Read("left.joint_position_rad"), {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6});
  ExpectNear(Read("right.joint_velocity_radps"), {-1, -1.1, -1.2, -1.3, -1.4, -1.5, -1.6});
}

TEST_F(SignalTest, ChosenScaledAndRounded) {
  ExpectNear(Read(Signal{.name = "left.joint_position_rad", .indices = {6, 0}}), {0.6, 0});
  ExpectNear(Read(Signal{.name = "left.gripper_opening", .indices = {}, .scale = -1, .offset = 1}), {0.75});
  // RoboEval rounds to one decimal, and halves to even. 0.25 is exact in binary.
  ExpectNear(Read(Signal{.name = "left.gripper_opening", .indices = {}, .decimals = 1}), {0.2});
}

// Lists what each convention shows for an opening.
TEST_F(SignalTest, GrippersOfEachConvention) {
  struct Shown {
    const char* convention;
    double scale, offset;
    int decimals;
    double opening, value;
  };
  const Shown shown[] = {
      {"evalbus", 1, 0, -1, 0.3, 0.3},
      {"RoboEval", 1, 0, 1, 0.96, 1},
      {"RoboEval", 1, 0, 1, 0.94, 0.9},
      {"RoboEval", 1, 0, 1, 0.04, 0},
      // The value is exactly in the middle, which NumPy rounds to even.
      {"RoboEval", 1, 0, 1, 0.75, 0.8},
      {"DROID", -1, 1, -1, 1, 0},
      {"DROID", -1, 1, -1, 0.25, 0.75},
      {"finger meters", 0.04, 0, -1, 0.5, 0.02},
      {"the other finger of LIBERO", -0.04, 0, -1, 0.5, -0.02},
      {"GR00T close", -1, 1, -1, 0, 1},
  };
  for (const Shown& row : shown) {
    SCOPED_TRACE(row.convention);
    state_.gripper[0].opening = row.opening;
    Signal signal;
    signal.name = "left.gripper_opening";
    signal.scale = row.scale;
    signal.offset = row.offset;
    signal.decimals = row.decimals;
    ExpectNear(Read(signal), {row.value});
  }
}

TEST_F(SignalTest, Fingers) {
  const mjModel& model = GetPolicyScene().model();
  for (const char* name : {"left/hand/finger_joint1", "left/hand/finger_joint2"}) {
    const int joint = mj_name2id(&model, mjOBJ_JOINT, name);
    ASSERT_GE(joint, 0) << name;
    state_.qpos_mixed[static_cast<size_t>(model.jnt_qposadr[joint])] = name[22] == '1' ? 0.03 : 0.01;
    state_.qvel_mixed[static_cast<size_t>(model.jnt_dofadr[joint])] = name[22] == '1' ? 0.5 : -0.5;
  }
  ExpectNear(Read("left.finger_position_m"), {0.03, 0.01});
  ExpectNear(Read("left.finger_velocity_mps"), {0.5, -0.5});
  ExpectNear(Read("right.finger_position_m"), {0, 0});
}

TEST_F(SignalTest, PosesInEachForm) {
  const double half = std::numbers::sqrt2 / 2, quarter = std::numbers::pi / 2;
  ExpectNear(Read("left.position_m"), {0.5, 0.3, 1});
  ExpectNear(Read("left.quaternion_wxyz"), {half, 0, 0, half});
  ExpectNear(Read("left.quaternion_xyzw"), {0, 0, half, half});
  ExpectNear(Read("left.axis_angle_rad"), {0, 0, quarter});
  ExpectNear(Read("left.euler_xyz_extrinsic_rad"), {0, 0, quarter});
  // The columns are y and -x.
  ExpectNear(Read("left.rotation_6d"), {0, 1, 0, -1, 0, 0});
}

// Over the whole range of the joints, the quaternion is continuous, like the one that MuJoCo composes along
// the arm. robosuite and LIBERO have such quaternions. One computed from a matrix jumps to the opposite sign.
TEST_F(SignalTest, QuaternionsKeepTheSignOfTheBodysAllOverTheRange) {
  const PolicyScene& scene = GetPolicyScene();
  const mjModel& model = scene.model();
  const arm_info_t& arm = scene.info().arm[0];
  const int site = mj_name2id(&model, mjOBJ_SITE, arm.wrist_site.c_str());
  const DataPtr data(mj_makeData(&model));
  // Returns the orientation of the site, which is the product of its body's and its own.
  const auto composed = [&](const std::vector<double>& joints) {
    for (size_t j = 0; j < joints.size(); ++j) data->qpos[arm.joint_qpos_index[j]] = joints[j];
    mj_kinematics(&model, data.get());
    std::vector<double> quat(4);
    mju_mulQuat(quat.data(), data->xquat + 4 * model.site_bodyid[site], model.site_quat + 4 * site);
    state_.arm[0].joint_position_rad = joints;
    std::copy_n(data->site_xpos + 3 * site, 3, state_.arm[0].wrist_position_m);
    mju_mat2Quat(state_.arm[0].wrist_quat_wxyz, data->site_xmat + 9 * site);
    return quat;
  };
  const SignalReader reader({Signal{.name = "left.quaternion_wxyz", .indices = {}}}, model, scene.info());
  const std::vector<double> home = composed(arm.joint_home_rad), shown_home = reader.Read(state_);
  const auto largest =
      std::ranges::max_element(shown_home, [](double a, double b) { return std::abs(a) < std::abs(b); });
  EXPECT_GT(*largest, 0);
  const double sign = home[static_cast<size_t>(largest - shown_home.begin())] > 0 ? 1 : -1;
  Random random(4, 0);
  int flipped = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<double> joints;
    for (size_t j = 0; j < arm.joint_lower_rad.size(); ++j)
      joints.push_back(random.Uniform(arm.joint_lower_rad[j], arm.joint_upper_rad[j]));
    std::vector<double> expected = composed(joints);
    for (double& value : expected) value *= sign;
    ExpectNear(reader.Read(state_), expected);
    const double* made = state_.arm[0].wrist_quat_wxyz;
    flipped += std::inner_product(made, made + 4, expected.begin(), 0.0) < 0;
  }
  // In these cases the quaternion in STATE had the other sign.
  EXPECT_GT(flipped, 20);
}

// The task places the robot's origin. The arms are mounted at y = +-0.3, 0.6 m above it.
TEST_F(SignalTest, PosesInTheArmsBase) {
  const auto left = Read(Signal{.name = "left.position_m", .indices = {}, .frame = ActionFrame::kBase});
  const auto right = Read(Signal{.name = "right.position_m", .indices = {}, .frame = ActionFrame::kBase});
  ExpectNear(left, right);
  ASSERT_EQ(left.size(), 3u);
  EXPECT_NEAR(left[1], 0, 1e-12);
}

TEST_F(SignalTest, ObjectsAreNamedAsTheTaskDoes) {
  const model_info_t& info = GetPolicyScene().info();
  ASSERT_FALSE(info.object_name.empty());
  const auto body = std::ranges::find(info.body_entity, info.object_entity[0]) - info.body_entity.begin();
  state_.body[static_cast<size_t>(body)].position_m[2] = 0.9;
  state_.body[static_cast<size_t>(body)].quat_wxyz[0] = 1;
  ExpectNear(Read("object." + info.object_name[0] + ".position_m"), {0, 0, 0.9});
  EXPECT_TRUE((Signal{.name = "object.pot.position_m", .indices = {}}.is_privileged()));
}

TEST_F(SignalTest, WhatTheModelHasNot) {
  EXPECT_THROW(Read("middle.joint_position_rad"), InputError);
  EXPECT_THROW(Read("object.kettle.position_m"), InputError);
  EXPECT_THROW(Read(Signal{.name = "left.joint_position_rad", .indices = {7}}), InputError);
}

}  // namespace evalbus::policy::signal_test
