// What a policy's numbers mean: the action space of a contract, and one library that makes joint targets of
// it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
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

// Is added to a joint position or pose, DeltaOn.
inline bool IsDelta(ActionKind kind) {
  return kind == ActionKind::kJointDelta || kind == ActionKind::kJointVelocity ||
         kind == ActionKind::kEefDelta;
}

// What a delta, and what a velocity brings about in a step, is added to: the last joint target (of an
// episode's first step: the measured position), or the measured joint position. A pose's is that of these
// joints.
enum class DeltaOn { kTarget, kMeasured };

// In which frame positions, translations and rotations are given. kBase: of the body that the arm's first
// link turns on (the arm's mount). kWrist: of the EefPoint itself as it stands before the step (deltas only).
enum class ActionFrame { kWorld, kBase, kWrist };

// What a pose is of: the wrist site of MODEL, or the middle between the pads (origin and axes: Arm::grip).
enum class EefPoint { kFlange, kGrip };

enum class RotationForm {
  kNone,  // position alone, the orientation stays as the episode began
  kQuaternionWxyz,
  kQuaternionXyzw,
  kAxisAngle,
  kAxisAngleRobosuite,     // as robosuite's quat2axisangle makes it: angle 0 to 2 pi, not the shortest
  kEulerXyzExtrinsic,      // roll, pitch, yaw about the fixed x, then y, then z: R = Rz Ry Rx
  kEulerXyzIntrinsic,      // R = Rx Ry Rz
  kRotation6d,             // first two columns of the matrix, one after the other (x1 y1 z1 x2 y2 z2)
  kRotation6dInterleaved,  // the same by rows (x1 x2 y1 y2 z1 z2)
  kRotation6dRows,         // first two rows of the matrix, one after the other, as PyTorch3D makes it
};
int NumValues(RotationForm form);

struct GripperForm {
  // Index in the row; nothing: the policy has no gripper and it stays open.
  std::optional<int> index = {};
  // What the policy says for a gripper that is fully open, and fully closed; in between linear.
  double open = 0, closed = 1;
  // Of the closing that follows (0 open, 1 closed), from 0 to under 1: larger is closed, else open. Nothing:
  // as it is.
  std::optional<double> threshold = {};
  // A thresholded gripper, which begins open, changes only after so many steps in a row want it.
  int sticky_steps = 1;
};

// One arm's part of a row.
struct ArmForm {
  // As in MODEL.
  std::string arm;
  // Where its joints (in the arm's order) or its position and rotation (position 3, then the rotation's) are
  // in the row.
  std::vector<int> indices;
  GripperForm gripper;
};

struct ActionSpace {
  ActionKind kind = ActionKind::kJointPosition;
  DeltaOn delta_on = DeltaOn::kTarget;
  ActionFrame frame = ActionFrame::kWorld;
  EefPoint point = EefPoint::kFlange;
  RotationForm rotation = RotationForm::kQuaternionWxyz;
  // Values of a row; what no arm takes is ignored. Arms of the robot that are not here stay at home.
  int num_values = 0;
  std::vector<ArmForm> arms;
  // Of each value of a row, before anything else: value * scale + offset, then clipped. Empty: as it is.
  std::vector<double> scale, offset, lower, upper;
};

// As contracts name them, and POLICY_ACTION the kind.
template <typename T>
struct Named {
  const char* name;
  T value;
};
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
const char* NameOf(ActionKind kind);

}  // namespace evalbus::policy
