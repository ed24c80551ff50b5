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

}  // namespace evalbus::policy
