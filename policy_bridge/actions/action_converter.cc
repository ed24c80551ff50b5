#include "policy_bridge/actions/action_converter.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "models/model_names.h"
#include "models/yaml_reader.h"
#include "policy_bridge/actions/rotation.h"
#include "policy_bridge/planning/ik.h"

namespace evalbus::policy {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kPositionValues = 3;

// This tolerance is tighter than the default of SolveIk(), because the errors of many small deltas
// accumulate. It is used in a second search that starts from the result of the first one. The start is also
// the posture, so the posture no longer pulls the arm away from the pose.
constexpr double kIkTolerance = 1e-9;  // m and rad

// If the result of the search is farther than this from the pose, the search is repeated from the home
// position.
constexpr double kStuckPosition = 0.05;  // m
constexpr double kStuckRotation = 0.2;   // rad

using Vector6 = Eigen::Matrix<double, 6, 1>;
constexpr size_t kMaxRotationValues = 6;

int FirstBody(const mjModel& model, const arm_info_t& arm) {
  for (int joint = 0; joint < model.njnt; ++joint) {
    if (model.jnt_qposadr[joint] == arm.joint_qpos_index.at(0)) return model.jnt_bodyid[joint];
  }
  throw InputError(
      fmt::format("arm \"{}\": no joint of the model has index {} in qpos, that of the arm's first joint",
                  arm.name, arm.joint_qpos_index.at(0)));
}

// Returns an upper bound of the wrist's distance from the base's origin for any joint positions, m.
double Reach(const mjModel& model, const arm_info_t& arm) {
  const int base = model.body_parentid[FirstBody(model, arm)];
  const int site = mj_name2id(&model, mjOBJ_SITE, arm.wrist_site.c_str());
  double reach = Vector3d(model.site_pos + 3 * site).norm();
  for (int body = model.site_bodyid[site]; body > 0 && body != base; body = model.body_parentid[body]) {
    reach += Vector3d(model.body_pos + 3 * body).norm();
    for (int i = 0; i < model.body_jntnum[body]; ++i) {
      reach += 2 * Vector3d(model.jnt_pos + 3 * (model.body_jntadr[body] + i)).norm();
    }
  }
  return reach;
}

// Moves `point` toward `center` until it is at most `distance` away. Works even for numbers whose squares
// overflow a double.
Vector3d NoFartherThan(double distance, const Vector3d& center, const Vector3d& point) {
  const Vector3d away = point - center;
  const double norm = away.stableNorm();
  return norm > distance ? Vector3d(center + away * (distance / norm)) : point;
}

Isometry3d MakePose(const Vector3d& position, const Matrix3d& rotation) {
  Isometry3d pose;
  pose.makeAffine();
  pose.translation() = position;
  pose.linear() = rotation;
  return pose;
}

bool IsWithin(const Vector6& difference, double position, double rotation) {
  return difference.head<3>().stableNorm() <= position && difference.tail<3>().norm() <= rotation;
}

JointVector Solve(const ArmChain& chain, const Isometry3d& pose, const JointVector& start) {
  const IkResult result = SolveIk(chain, pose, start);
  if (!result.converged) return result.joints;
  IkOptions exactly;
  exactly.tolerance = kIkTolerance;
  return SolveIk(chain, pose, result.joints, exactly).joints;
}

// Finds joint positions for an absolute pose, which may be far from the start. If the previous pose stretched
// the arm out, a search from there may stay at a joint limit forever. Therefore home is tried as a second
// start.
JointVector SolveAnywhere(const ArmChain& chain, const Isometry3d& pose, const JointVector& start) {
  const JointVector joints = Solve(chain, pose, start);
  const Vector6 left = PoseDifference(chain.Forward(joints), pose);
  if (IsWithin(left, kStuckPosition, kStuckRotation)) return joints;
  const JointVector other = Solve(chain, pose, chain.home());
  const Vector6 other_left = PoseDifference(chain.Forward(other), pose);
  // The other solution must be much better; otherwise the arm might alternate between two equally good
  // solutions.
  return other_left.squaredNorm() < left.squaredNorm() / 2 ? other : joints;
}

void CheckLength(const std::vector<double>& values, int expected, const char* what) {
  if (!values.empty() && values.size() != static_cast<size_t>(expected)) {
    throw InputError(
        fmt::format("action: {} has {} numbers, but a row has {} values", what, values.size(), expected));
  }
}

}  // namespace

double ConditionNumber(const Jacobian& jacobian) {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  Square square;
  if (jacobian.cols() < 6) {
    square = jacobian.transpose() * jacobian;
  } else {
    square = jacobian * jacobian.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Square> solver(square, Eigen::EigenvaluesOnly);
  const double least = solver.eigenvalues().minCoeff(), most = solver.eigenvalues().maxCoeff();
  return least > 0 ? std::sqrt(most / least) : std::numeric_limits<double>::infinity();
}

Isometry3d BasePose(const mjModel& model, const arm_info_t& arm) {
  Isometry3d pose = Isometry3d::Identity();
  for (int body = model.body_parentid[FirstBody(model, arm)]; body > 0; body = model.body_parentid[body]) {
    pose = ToPose(model.body_pos + 3 * body, model.body_quat + 4 * body) * pose;
  }
  return pose;
}

ActionConverter::ActionConverter(const ActionSpace& space, const mjModel& model, const model_info_t& info)
    : space_(space), num_arms_(info.arm.size()), num_grippers_(info.gripper.size()) {
  CheckSpace();
  for (const ArmForm& form : space_.arms) arms_.push_back(MakeArm(form, model, info));
  if (!is_joint_kind() && space_.point == EefPoint::kGrip) {
    const std::vector<Arm> arms = MakeArms(model, info);
    for (ArmPart& arm : arms_) arm.point = arms[arm.index].grip;
  }
  for (const arm_info_t& arm : info.arm) {
    home_.insert(home_.end(), arm.joint_home_rad.begin(), arm.joint_home_rad.end());
  }
  values_.resize(space_.num_values);
}

bool ActionConverter::is_joint_kind() const {
  return space_.kind != ActionKind::kEefPose && space_.kind != ActionKind::kEefDelta;
}

bool ActionConverter::is_absolute() const {
  return space_.kind == ActionKind::kJointPosition || space_.kind == ActionKind::kEefPose;
}

void ActionConverter::CheckSpace() const {
  if (space_.arms.empty()) throw InputError("action: no arm uses any of its values");
  if (space_.kind == ActionKind::kEefPose && space_.frame == ActionFrame::kWrist) {
    throw InputError(
        "action: an eef_pose must be in the world or base frame; only an eef_delta can be in the wrist "
        "frame");
  }
  CheckLength(space_.scale, space_.num_values, "scale");
  CheckLength(space_.offset, space_.num_values, "offset");
  CheckLength(space_.lower, space_.num_values, "lower");
  CheckLength(space_.upper, space_.num_values, "upper");
  const auto finite = [](double x) { return std::isfinite(x); };
  if (!std::all_of(space_.scale.begin(), space_.scale.end(), finite) ||
      !std::all_of(space_.offset.begin(), space_.offset.end(), finite)) {
    throw InputError("action: scale and offset must be finite");
  }
  for (int i = 0; i < space_.num_values; ++i) {
    const double lower = space_.lower.empty() ? -std::numeric_limits<double>::infinity() : space_.lower[i];
    const double upper = space_.upper.empty() ? std::numeric_limits<double>::infinity() : space_.upper[i];
    if (!(lower <= upper)) {
      throw InputError(
          fmt::format("action: value {}: expected lower <= upper, got {} and {}", i, lower, upper));
    }
  }
  std::set<std::string> names;
  std::set<int> taken;
  const auto check_range = [&](const ArmForm& form, int index) {
    if (index < 0 || index >= space_.num_values) {
      throw InputError(fmt::format("action: arm '{}': index {}; a row has the values 0 to {}", form.arm,
                                   index, space_.num_values - 1));
    }
  };
  for (const ArmForm& form : space_.arms) {
    if (!names.insert(form.arm).second) throw InputError("action: arm '" + form.arm + "' is given twice");
    for (int index : form.indices) {
      check_range(form, index);
      if (!taken.insert(index).second) {
        throw InputError(fmt::format("action: arm '{}': value {} is used twice", form.arm, index));
      }
    }
  }
  // Grippers are not checked for shared indices, because two grippers may use the same value.
  for (const ArmForm& form : space_.arms) {
    if (!form.gripper.index) continue;
    check_range(form, *form.gripper.index);
    if (taken.contains(*form.gripper.index)) {
      throw InputError(fmt::format("action: arm '{}': the gripper's value {} is also used by an arm",
                                   form.arm, *form.gripper.index));
    }
  }
}

ActionConverter::ArmPart ActionConverter::MakeArm(const ArmForm& form, const mjModel& model,
                                                  const model_info_t& info) const {
  const std::vector<std::string> names = ArmNames(info);
  const auto found = std::find(names.begin(), names.end(), form.arm);
  if (found == names.end()) {
    throw InputError("action: the robot has no arm '" + form.arm + "'" + Suggestion(form.arm, names));
  }
  const auto index = static_cast<int>(found - names.begin());
  const arm_info_t& arm_info = info.arm[index];
  const int expected = is_joint_kind() ? arm_info.num_joints : kPositionValues + NumValues(space_.rotation);
  if (form.indices.size() != static_cast<size_t>(expected)) {
    const std::string parts = is_joint_kind() ? "one for each joint"
                                              : fmt::format("{} for the position and {} for the rotation",
                                                            kPositionValues, NumValues(space_.rotation));
    throw InputError(fmt::format("action: arm '{}': {} indices; {} takes {}, {}", form.arm,
                                 form.indices.size(), NameOf(space_.kind), expected, parts));
  }
  if (arm_info.num_joints > kMaxArmJoints) {
    throw InputError(fmt::format("action: arm '{}': {} joints; at most {} can be commanded", form.arm,
                                 arm_info.num_joints, kMaxArmJoints));
  }
  ArmPart arm{
      .form = form,
      .index = index,
      .num_joints = arm_info.num_joints,
      .gripper_command = GripperCommand(form.gripper),
      .lower = Eigen::Map<const Eigen::VectorXd>(arm_info.joint_lower_rad.data(), arm_info.num_joints),
      .upper = Eigen::Map<const Eigen::VectorXd>(arm_info.joint_upper_rad.data(), arm_info.num_joints),
      .base = Isometry3d::Identity(),
      .point = Isometry3d::Identity(),
      .first_rotation = Matrix3d::Identity()};
  for (int i = 0; i < index; ++i) arm.first_joint += info.arm[i].num_joints;
  for (size_t i = 0; i < info.gripper.size(); ++i) {
    if (info.gripper[i].arm == index) arm.gripper = static_cast<int>(i);
  }
  if (form.gripper.index && arm.gripper < 0) {
    throw InputError("action: arm '" + form.arm + "' has no gripper that could be commanded");
  }
  if (!is_joint_kind()) {
    arm.chain.emplace(model, arm_info);
    arm.base = BasePose(model, arm_info);
    arm.reach = Reach(model, arm_info);
  }
  return arm;
}

void ActionConverter::Begin() {
  has_begun_ = false;
  for (ArmPart& arm : arms_) arm.gripper_command.Begin();
}

void ActionConverter::ReadRow(std::span<const double> row) {
  if (row.size() != values_.size()) {
    throw std::runtime_error(
        fmt::format("the policy's action has {} values, expected {}", row.size(), values_.size()));
  }
  for (size_t i = 0; i < row.size(); ++i) {
    double value = row[i];
    if (!space_.scale.empty()) value *= space_.scale[i];
    if (!space_.offset.empty()) value += space_.offset[i];
    values_[i] = value;
  }
  for (const ArmPart& arm : arms_) {
    const auto check = [&](int index, const char* whose) {
      if (std::isfinite(values_[index])) return;
      throw std::runtime_error(fmt::format(
          "value {} of the policy's action, for {} '{}', is {}; expected a finite number{}", index, whose,
          arm.form.arm, row[index], std::isfinite(row[index]) ? " after scale and offset" : ""));
    };
    for (int index : arm.form.indices) check(index, "arm");
    if (arm.form.gripper.index) check(*arm.form.gripper.index, "the gripper of arm");
  }
  for (size_t i = 0; i < row.size(); ++i) {
    if (!space_.lower.empty()) values_[i] = std::max(values_[i], space_.lower[i]);
    if (!space_.upper.empty()) values_[i] = std::min(values_[i], space_.upper[i]);
  }
}

JointVector ActionConverter::Measured(const ArmPart& arm, const state_t& state) const {
  const std::vector<double>& joints = state.arm[arm.index].joint_position_rad;
  if (joints.size() != static_cast<size_t>(arm.num_joints)) {
    throw std::runtime_error(fmt::format("the state has {} joints of arm '{}', the model {}", joints.size(),
                                         arm.form.arm, arm.num_joints));
  }
  return Eigen::Map<const Eigen::VectorXd>(joints.data(), arm.num_joints);
}

// Returns the pose of the wrist in the world frame.
Isometry3d ActionConverter::TargetPose(const ArmPart& arm, const JointVector& from) const {
  const std::vector<int>& indices = arm.form.indices;
  const Vector3d position(values_[indices[0]], values_[indices[1]], values_[indices[2]]);
  double rotation_values[kMaxRotationValues];
  const auto num_rotation_values = static_cast<size_t>(NumValues(space_.rotation));
  for (size_t i = 0; i < num_rotation_values; ++i) {
    rotation_values[i] = values_[indices[kPositionValues + i]];
  }
  Matrix3d rotation;
  try {
    rotation = ReadRotation(space_.rotation, {rotation_values, num_rotation_values}).toRotationMatrix();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("values {} of the policy's action, for arm '{}': {}",
                                         fmt::join(indices.begin() + kPositionValues, indices.end(), ", "),
                                         arm.form.arm, error.what()));
  }

  Isometry3d point;
  if (space_.kind == ActionKind::kEefPose) {
    point = MakePose(position, rotation);
    if (space_.frame == ActionFrame::kBase) point = arm.base * point;
  } else {
    const Isometry3d now = arm.chain->Forward(from) * arm.point;
    // Axes in which the delta is expressed.
    Matrix3d axes = Matrix3d::Identity();
    if (space_.frame == ActionFrame::kBase) axes = arm.base.linear();
    if (space_.frame == ActionFrame::kWrist) axes = now.linear();
    point = MakePose(now.translation() + axes * position, axes * rotation * axes.transpose() * now.linear());
  }
  if (space_.rotation == RotationForm::kNone) point.linear() = arm.first_rotation;
  if (!point.matrix().allFinite()) {
    throw std::runtime_error(fmt::format("values {} of the policy's action, for arm '{}', are too large",
                                         fmt::join(indices.begin(), indices.begin() + kPositionValues, ", "),
                                         arm.form.arm));
  }
  return point * arm.point.inverse();
}

void ActionConverter::Convert(std::span<const double> row, const state_t& state, double step_s,
                              action_t* action) {
  if (state.arm.size() != num_arms_) {
    throw std::runtime_error(fmt::format("the state has {} arms, the model {}", state.arm.size(), num_arms_));
  }
  ReadRow(row);
  action->mode = action_t::JOINT_POSITION;
  action->num_joints = static_cast<int32_t>(home_.size());
  action->joint_position_rad = home_;
  action->num_grippers = static_cast<int32_t>(num_grippers_);
  action->gripper_closing.assign(num_grippers_, 0.0);
  action->unreachable_poses = 0;
  action->singular_poses = 0;

  for (ArmPart& arm : arms_) {
    const JointVector measured = Measured(arm, state);
    if (!has_begun_) {
      arm.target = measured.cwiseMax(arm.lower).cwiseMin(arm.upper);
      if (arm.chain) arm.first_rotation = (arm.chain->Forward(measured) * arm.point).linear();
    }
    const JointVector& from = space_.delta_on == DeltaOn::kTarget ? arm.target : measured;
    JointVector joints(arm.num_joints);
    if (is_joint_kind()) {
      const double step = space_.kind == ActionKind::kJointVelocity ? step_s : 1;
      for (int j = 0; j < arm.num_joints; ++j) {
        const double value = values_[arm.form.indices[j]];
        joints[j] = is_absolute() ? value : from[j] + value * step;
      }
    } else {
      const Isometry3d wanted = TargetPose(arm, from);
      // The damping of the search grows with the error, so the arm would hardly move toward a target far out
      // of reach. The target is therefore moved to within the arm's length first.
      Isometry3d sought = wanted;
      sought.translation() = NoFartherThan(arm.reach, arm.base.translation(), wanted.translation());
      joints = is_absolute() ? SolveAnywhere(*arm.chain, sought, arm.target)
                             : Solve(*arm.chain, sought, arm.target);
      Jacobian jacobian;
      const Vector6 left = PoseDifference(arm.chain->Forward(joints, &jacobian), wanted);
      if (!IsWithin(left, kReachedPosition, kReachedRotation)) ++action->unreachable_poses;
      if (ConditionNumber(jacobian) > kSingularCondition) ++action->singular_poses;
    }
    std::copy(joints.begin(), joints.end(), action->joint_position_rad.begin() + arm.first_joint);
    arm.target = joints.cwiseMax(arm.lower).cwiseMin(arm.upper);
    if (arm.form.gripper.index) {
      action->gripper_closing[arm.gripper] = arm.gripper_command.Step(values_[*arm.form.gripper.index]);
    }
  }
  has_begun_ = true;
}

std::vector<double> ActionConverter::RowOf(const Configuration& from, const Configuration& to,
                                           double step_s) const {
  std::vector<double> row(values_.size(), 0.0);
  for (const ArmPart& arm : arms_) {
    const JointVector &before = from.joints.at(arm.index), &after = to.joints.at(arm.index);
    std::vector<double> values;
    if (is_joint_kind()) {
      const double step = space_.kind == ActionKind::kJointVelocity ? step_s : 1;
      for (int j = 0; j < arm.num_joints; ++j) {
        values.push_back(is_absolute() ? after[j] : (after[j] - before[j]) / step);
      }
    } else {
      const Isometry3d start = arm.chain->Forward(before) * arm.point;
      const Isometry3d end = arm.chain->Forward(after) * arm.point;
      Matrix3d axes = Matrix3d::Identity();
      if (space_.frame == ActionFrame::kBase) axes = arm.base.linear();
      if (space_.frame == ActionFrame::kWrist) axes = start.linear();
      Vector3d position;
      Matrix3d rotation;
      if (is_absolute()) {
        const Isometry3d pose = space_.frame == ActionFrame::kBase ? arm.base.inverse() * end : end;
        position = pose.translation();
        rotation = pose.linear();
      } else {
        position = axes.transpose() * (end.translation() - start.translation());
        rotation = axes.transpose() * end.linear() * start.linear().transpose() * axes;
      }
      values.resize(arm.form.indices.size());
      std::copy_n(position.data(), kPositionValues, values.begin());
      WriteRotation(space_.rotation, Eigen::Quaterniond(rotation),
                    std::span(values).subspan(kPositionValues));
    }
    for (size_t i = 0; i < values.size(); ++i) row[arm.form.indices[i]] = values[i];
    if (arm.form.gripper.index) {
      row[*arm.form.gripper.index] = ValueOf(arm.form.gripper, to.closing.at(arm.gripper));
    }
  }
  for (size_t i = 0; i < row.size(); ++i) {
    if (!space_.offset.empty()) row[i] -= space_.offset[i];
    if (!space_.scale.empty()) row[i] = space_.scale[i] == 0 ? 0 : row[i] / space_.scale[i];
  }
  return row;
}

}  // namespace evalbus::policy
