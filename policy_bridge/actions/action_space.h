// The action space of a contract: the meaning of the numbers in a policy's action.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::policy {

enum class ActionKind {
  kJointPosition,  // absolute, rad
  kJointDelta,     // rad per step
  kJointVelocity,  // rad/s
  kEefPose,        // absolute pose
  kEefDelta,       // translation (m) and rotation per step
};

// Returns whether the action is added to a joint position or pose, which DeltaOn selects.
inline bool IsDelta(ActionKind kind) {
  return kind == ActionKind::kJointDelta || kind == ActionKind::kJointVelocity ||
         kind == ActionKind::kEefDelta;
}

// Joint positions to which a delta, or the displacement that a velocity yields in one step, is added.
// kTarget: the last joint target; in an episode's first step, the measured positions. kMeasured: the measured
// positions. A delta of a pose is added to the pose at these joint positions.
enum class DeltaOn { kTarget, kMeasured };

// Frame in which positions, translations and rotations are given. kBase: frame of the body that the arm's
// first link is attached to (the arm's mount). kWrist: frame of the EefPoint before the step (deltas only).
enum class ActionFrame { kWorld, kBase, kWrist };

// Point that a pose refers to. kFlange: the wrist site of MODEL. kGrip: the point midway between the pads,
// with the axes of Arm::grip.
enum class EefPoint { kFlange, kGrip };

enum class RotationForm {
  kNone,  // position only; the orientation is kept from the beginning of the episode
  kQuaternionWxyz,
  kQuaternionXyzw,
  kAxisAngle,
  kAxisAngleRobosuite,     // as returned by robosuite's quat2axisangle: angle 0 to 2 pi, not the shortest
  kEulerXyzExtrinsic,      // roll, pitch, yaw about the fixed x, then y, then z axis: R = Rz Ry Rx
  kEulerXyzIntrinsic,      // R = Rx Ry Rz
  kRotation6d,             // first two columns of the matrix, concatenated (x1 y1 z1 x2 y2 z2)
  kRotation6dInterleaved,  // first two columns, interleaved by rows (x1 x2 y1 y2 z1 z2)
  kRotation6dRows,         // first two rows of the matrix, concatenated, as in PyTorch3D
};
int NumValues(RotationForm form);

struct GripperForm {
  // Index in the row. Unset: the policy does not control the gripper, which stays open.
  std::optional<int> index = {};
  // Values for a fully open and a fully closed gripper. The closing is linear between them.
  double open = 0, closed = 1;
  // Threshold of the closing (0 open, 1 closed), at least 0 and below 1. Larger values close the gripper
  // fully, all others open it fully. Unset: no threshold.
  std::optional<double> threshold = {};
  // Number of consecutive steps that must request the other state before a gripper with a threshold changes
  // its state. The gripper is open at the beginning of an episode.
  int sticky_steps = 1;
};

// Part of a row that controls one arm.
struct ArmForm {
  // Name of the arm in MODEL.
  std::string arm;
  // Joint kinds: indices in the row of the joints, in the arm's order. Pose kinds: indices of the position (3
  // values) and then of the rotation.
  std::vector<int> indices;
  GripperForm gripper;
};

struct ActionSpace {
  ActionKind kind = ActionKind::kJointPosition;
  DeltaOn delta_on = DeltaOn::kTarget;
  ActionFrame frame = ActionFrame::kWorld;
  EefPoint point = EefPoint::kFlange;
  RotationForm rotation = RotationForm::kQuaternionWxyz;
  // Number of values in a row; values that no arm uses are ignored. Arms of the robot that are not listed in
  // `arms` stay at home.
  int num_values = 0;
  std::vector<ArmForm> arms;
  // Each value of a row is first replaced by value * scale + offset, then clipped to [lower, upper]. An empty
  // list is not applied.
  std::vector<double> scale, offset, lower, upper;
};

// A value and its name in contracts. Names of action kinds are also used in POLICY_ACTION.
template <typename T>
struct Named {
  const char* name;
  T value;
};
template <class Choice, size_t N>
const char* WordOf(Choice choice, const Named<Choice> (&words)[N]) {
  for (const auto& word : words) {
    if (word.value == choice) return word.name;
  }
  return "";
}
inline constexpr Named<ActionKind> kActionKinds[] = {{"joint_position", ActionKind::kJointPosition},
                                                     {"joint_delta", ActionKind::kJointDelta},
                                                     {"joint_velocity", ActionKind::kJointVelocity},
                                                     {"eef_pose", ActionKind::kEefPose},
                                                     {"eef_delta", ActionKind::kEefDelta}};
inline constexpr Named<DeltaOn> kDeltaOns[] = {{"target", DeltaOn::kTarget},
                                               {"measured", DeltaOn::kMeasured}};
inline constexpr Named<ActionFrame> kActionFrames[] = {
    {"world", ActionFrame::kWorld}, {"base", ActionFrame::kBase}, {"wrist", ActionFrame::kWrist}};
inline constexpr Named<EefPoint> kEefPoints[] = {{"flange", EefPoint::kFlange}, {"grip", EefPoint::kGrip}};
inline constexpr Named<RotationForm> kRotationForms[] = {
    {"none", RotationForm::kNone},
    {"quaternion_wxyz", RotationForm::kQuaternionWxyz},
    {"quaternion_xyzw", RotationForm::kQuaternionXyzw},
    {"axis_angle", RotationForm::kAxisAngle},
    {"axis_angle_robosuite", RotationForm::kAxisAngleRobosuite},
    {"euler_xyz_extrinsic", RotationForm::kEulerXyzExtrinsic},
    {"euler_xyz_intrinsic", RotationForm::kEulerXyzIntrinsic},
    {"rotation_6d", RotationForm::kRotation6d},
    {"rotation_6d_interleaved", RotationForm::kRotation6dInterleaved},
    {"rotation_6d_rows", RotationForm::kRotation6dRows}};
inline const char* NameOf(ActionKind kind) { return WordOf(kind, kActionKinds); }

}  // namespace evalbus::policy
