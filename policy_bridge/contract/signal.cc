#include "policy_bridge/contract/signal.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/errors.h"
#include "models/yaml_reader.h"
#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/actions/rotation.h"
#include "policy_bridge/planning/kinematics.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {
namespace {

using Reader = std::function<void(const state_t&, std::vector<double>*)>;

// Returns the signal's name of a rotation: the form's name and, if its values are angles, their unit.
std::string SignalName(const Named<RotationForm>& rotation) {
  const std::string name = rotation.name;
  return name + (name.starts_with("axis_angle") || name.starts_with("euler") ? "_rad" : "");
}

std::vector<std::string> WithRotations(std::vector<std::string> names) {
  for (const auto& rotation : kRotationForms) {
    if (rotation.value != RotationForm::kNone) names.push_back(SignalName(rotation));
  }
  return names;
}

using Rotation = std::function<Eigen::Quaterniond(const state_t&)>;

// Returns a function that reads the part `what` of a pose.
Reader PoseReader(const std::string& what, const std::function<Eigen::Isometry3d(const state_t&)>& pose,
                  const Rotation& rotation) {
  if (what == "position_m") {
    return [pose](const state_t& state, std::vector<double>* values) {
      const Eigen::Vector3d position = pose(state).translation();
      values->insert(values->end(), position.begin(), position.end());
    };
  }
  const auto found = std::ranges::find(kRotationForms, what, SignalName);
  return [rotation, form = found->value](const state_t& state, std::vector<double>* values) {
    const size_t size = values->size();
    values->resize(size + static_cast<size_t>(NumValues(form)));
    WriteRotation(form, rotation(state), std::span(*values).subspan(size));
  };
}

// Returns whether the signal depends on the sign of the quaternion.
bool ShowsSign(const std::string& what) {
  return what.starts_with("quaternion_") || what == "axis_angle_robosuite_rad";
}

// Returns the ids of the joints of the fingers that carry a gripper's pads.
std::vector<int> FingerJoints(const mjModel& model, const gripper_info_t& gripper) {
  std::vector<int> joints;
  for (const int geom : gripper.pad_geom) {
    const int body = model.geom_bodyid[geom];
    for (int i = 0; i < model.body_jntnum[body]; ++i) joints.push_back(model.body_jntadr[body] + i);
  }
  std::ranges::sort(joints);
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  return joints;
}

class Readers {
 public:
  Readers(const mjModel& model, const model_info_t& info) : model_(model), info_(info) {}

  Reader Of(const Signal& signal) {
    const size_t dot = signal.name.rfind('.');
    const std::string owner = signal.name.substr(0, dot), what = signal.name.substr(dot + 1);
    return signal.is_privileged() ? OfObject(owner.substr(owner.find('.') + 1), what, signal.frame)
                                  : OfArm(owner, what, signal);
  }

 private:
  Reader OfObject(const std::string& object, const std::string& what, ActionFrame frame) {
    if (frame != ActionFrame::kWorld) {
      throw InputError("signal object." + object + "." + what +
                       ": frame: expected world; poses of objects are only available in the world frame");
    }
    const int body = ObjectBody(info_, object);
    const auto pose = [body](const state_t& state) { return BodyPose(state, body); };
    return PoseReader(what, pose,
                      [pose](const state_t& state) { return Eigen::Quaterniond(pose(state).linear()); });
  }

  Reader OfArm(const std::string& arm, const std::string& what, const Signal& signal) {
    std::vector<std::string> arms;
    for (const arm_info_t& known : info_.arm) arms.push_back(known.name);
    const auto found = std::ranges::find(arms, arm);
    if (found == arms.end()) {
      throw InputError("signal " + signal.name + ": the robot has no arm '" + arm + "'" +
                       Suggestion(arm, arms));
    }
    const auto index = static_cast<size_t>(found - arms.begin());
    if (what == "joint_position_rad") {
      return [index](const state_t& state, std::vector<double>* values) {
        const auto& joints = state.arm.at(index).joint_position_rad;
        values->insert(values->end(), joints.begin(), joints.end());
      };
    }
    if (what == "joint_velocity_radps") {
      return [index](const state_t& state, std::vector<double>* values) {
        const auto& joints = state.arm.at(index).joint_velocity_radps;
        values->insert(values->end(), joints.begin(), joints.end());
      };
    }
    if (what == "gripper_opening" || what.starts_with("finger_")) return OfGripper(index, what, signal.name);
    const auto pose = Pose(index, signal);
    return PoseReader(
        what, pose, ShowsSign(what) ? Signed(index, signal) : [pose](const state_t& state) {
          return Eigen::Quaterniond(pose(state).linear());
        });
  }

  Reader OfGripper(size_t arm, const std::string& what, const std::string& name) {
    const auto gripper = std::ranges::find(info_.gripper, static_cast<int32_t>(arm), &gripper_info_t::arm);
    if (gripper == info_.gripper.end()) throw InputError("signal " + name + ": this arm has no gripper");
    if (what == "gripper_opening") {
      const auto index = static_cast<size_t>(gripper - info_.gripper.begin());
      return [index](const state_t& state, std::vector<double>* values) {
        values->push_back(state.gripper.at(index).opening);
      };
    }
    std::vector<size_t> coordinates;
    for (const int joint : FingerJoints(model_, *gripper)) {
      coordinates.push_back(static_cast<size_t>(what == "finger_position_m" ? model_.jnt_qposadr[joint]
                                                                            : model_.jnt_dofadr[joint]));
    }
    const auto member = what == "finger_position_m" ? &state_t::qpos_mixed : &state_t::qvel_mixed;
    return [coordinates, member](const state_t& state, std::vector<double>* values) {
      for (const size_t i : coordinates) values->push_back((state.*member).at(i));
    };
  }

  // Returns the transform from the world to the signal's frame, and the transform from the flange to the
  // signal's point.
  std::pair<Eigen::Isometry3d, Eigen::Isometry3d> Ends(size_t arm, const Signal& signal) {
    Eigen::Isometry3d from = Eigen::Isometry3d::Identity(), to = Eigen::Isometry3d::Identity();
    if (signal.frame == ActionFrame::kBase) from = BasePose(model_, info_.arm[arm]).inverse();
    if (signal.point == EefPoint::kGrip) to = MakeArms(model_, info_).at(arm).grip;
    return {from, to};
  }

  // Returns a function that reads the pose of an arm's flange or grip, in the world frame or the frame of its
  // base.
  std::function<Eigen::Isometry3d(const state_t&)> Pose(size_t arm, const Signal& signal) {
    const auto [from, to] = Ends(arm, signal);
    return [arm, from = from, to = to](const state_t& state) {
      const arm_state_t& now = state.arm.at(arm);
      return from * ToPose(now.wrist_position_m, now.wrist_quat_wxyz) * to;
    };
  }

  // Returns the quaternion of the pose that Pose() reads. Its largest component is positive at home. From
  // there, its sign follows the product of the quaternions along the joints, so it does not jump as the arm
  // moves. MuJoCo computes the quaternion of a body in this way. robosuite's eef_quat
  // (sim.data.get_body_xquat) and LIBERO's axis-angle are derived from it.
  Rotation Signed(size_t arm, const Signal& signal) {
    const auto [from, to] = Ends(arm, signal);
    const auto rotation = [chain = ArmChain(model_, info_.arm[arm]),
                           before = Eigen::Quaterniond(from.linear()),
                           behind = Eigen::Quaterniond(to.linear())](const JointVector& q) {
      return before * chain.Rotation(q) * behind;
    };
    const JointVector home = ArmChain(model_, info_.arm[arm]).home();
    Eigen::Index largest = 0;
    rotation(home).coeffs().cwiseAbs().maxCoeff(&largest);
    const double sign = std::copysign(1.0, rotation(home).coeffs()[largest]);
    return [arm, rotation, sign, pose = Pose(arm, signal)](const state_t& state) {
      const std::vector<double>& joints = state.arm.at(arm).joint_position_rad;
      const JointVector q =
          Eigen::Map<const Eigen::VectorXd>(joints.data(), static_cast<Eigen::Index>(joints.size()));
      Eigen::Quaterniond shown(pose(state).linear());
      if (sign * rotation(q).dot(shown) < 0) shown.coeffs() *= -1;
      return shown;
    };
  }

  const mjModel& model_;
  const model_info_t& info_;
};

double Shown(const Signal& signal, double value) {
  value = value * signal.scale + signal.offset;
  if (signal.decimals < 0) return value;
  const double unit = std::pow(10, signal.decimals);
  return std::nearbyint(value * unit) / unit;
}

}  // namespace

const std::vector<std::string>& ArmSignalNames() {
  static const std::vector<std::string> names =
      WithRotations({"joint_position_rad", "joint_velocity_radps", "gripper_opening", "finger_position_m",
                     "finger_velocity_mps", "position_m"});
  return names;
}

const std::vector<std::string>& ObjectSignalNames() {
  static const std::vector<std::string> names = WithRotations({"position_m"});
  return names;
}

SignalReader::SignalReader(const std::vector<Signal>& signals, const mjModel& model,
                           const model_info_t& info) {
  Readers readers(model, info);
  for (const Signal& signal : signals) {
    readers_.push_back(
        [signal, read = readers.Of(signal)](const state_t& state, std::vector<double>* values) {
          std::vector<double> all;
          read(state, &all);
          std::vector<double> chosen;
          for (const int index : signal.indices) {
            if (static_cast<size_t>(index) >= all.size()) {
              throw InputError("signal " + signal.name + ": expected indices less than " +
                               std::to_string(all.size()) + ", the number of its values, got " +
                               std::to_string(index));
            }
            chosen.push_back(all[static_cast<size_t>(index)]);
          }
          for (const double value : signal.indices.empty() ? all : chosen)
            values->push_back(Shown(signal, value));
        });
  }
}

std::vector<double> SignalReader::Read(const state_t& state) const {
  std::vector<double> values;
  for (const auto& read : readers_) read(state, &values);
  return values;
}

}  // namespace evalbus::policy
