#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

int NumValues(RotationForm form) {
  switch (form) {
    case RotationForm::kNone:
      return 0;
    case RotationForm::kQuaternionWxyz:
    case RotationForm::kQuaternionXyzw:
      return 4;
    case RotationForm::kAxisAngle:
    case RotationForm::kAxisAngleRobosuite:
    case RotationForm::kEulerXyzExtrinsic:
    case RotationForm::kEulerXyzIntrinsic:
      return 3;
    case RotationForm::kRotation6d:
    case RotationForm::kRotation6dInterleaved:
    case RotationForm::kRotation6dRows:
      return 6;
  }
  return 0;
}

const char* NameOf(ActionKind kind) {
  switch (kind) {
    case ActionKind::kJointPosition:
      return "joint_position";
    case ActionKind::kJointDelta:
      return "joint_delta";
    case ActionKind::kJointVelocity:
      return "joint_velocity";
    case ActionKind::kEefPose:
      return "eef_pose";
    case ActionKind::kEefDelta:
      return "eef_delta";
  }
  return "";
}

}  // namespace evalbus::policy
