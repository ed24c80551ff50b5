#include "policy_bridge/planning/kinematics.h"

#include <algorithm>

#include "base/errors.h"

namespace evalbus::policy {
namespace {

JointVector ToVector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace

Eigen::Isometry3d ToPose(const mjtNum* position, const mjtNum* quat) {
  return Eigen::Translation3d(position[0], position[1], position[2]) *
         Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]).normalized();
}

ArmChain::ArmChain(const mjModel& model, const arm_info_t& arm) {
  const std::string who = "arm \"" + arm.name + "\": ";
  if (arm.num_joints < 1 || arm.num_joints > kMaxArmJoints) {
    throw InputError(who + "expected 1 to " + std::to_string(kMaxArmJoints) + " joints, got " +
                     std::to_string(arm.num_joints));
  }
  const int site = mj_name2id(&model, mjOBJ_SITE, arm.wrist_site.c_str());
  if (site < 0) throw InputError(who + "the model has no site \"" + arm.wrist_site + "\"");

  std::vector<int> bodies;
  for (int body = model.site_bodyid[site]; body > 0; body = model.body_parentid[body]) bodies.push_back(body);
  std::reverse(bodies.begin(), bodies.end());

  Eigen::Isometry3d fixed = Eigen::Isometry3d::Identity();
  for (int body : bodies) {
    fixed = fixed * ToPose(model.body_pos + 3 * body, model.body_quat + 4 * body);
    for (int i = 0; i < model.body_jntnum[body]; ++i) {
      const int joint = model.body_jntadr[body] + i;
      const size_t index = joints_.size();
      if (model.jnt_type[joint] != mjJNT_HINGE || index >= arm.joint_qpos_index.size() ||
          arm.joint_qpos_index[index] != model.jnt_qposadr[joint]) {
        throw InputError(who + "the joints between the world and site \"" + arm.wrist_site +
                         "\" must be the arm's hinge joints, from the base to the wrist");
      }
      const Eigen::Vector3d anchor(model.jnt_pos + 3 * joint);
      joints_.push_back({fixed * Eigen::Translation3d(anchor), Eigen::Vector3d(model.jnt_axis + 3 * joint),
                         model.qpos0[model.jnt_qposadr[joint]]});
      fixed = Eigen::Translation3d(-anchor);
    }
  }
  if (num_joints() != arm.num_joints) {
    throw InputError(who + "site \"" + arm.wrist_site + "\" does not move with the arm's last joint");
  }
  wrist_ = fixed * ToPose(model.site_pos + 3 * site, model.site_quat + 4 * site);
  lower_ = ToVector(arm.joint_lower_rad);
  upper_ = ToVector(arm.joint_upper_rad);
  home_ = ToVector(arm.joint_home_rad);
}

Eigen::Quaterniond ArmChain::Rotation(const JointVector& q) const {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  for (int i = 0; i < num_joints(); ++i) {
    const Joint& joint = joints_[static_cast<size_t>(i)];
    rotation = rotation * Eigen::Quaterniond(joint.before.linear()) *
               Eigen::Quaterniond(Eigen::AngleAxisd(q[i] - joint.reference, joint.axis));
  }
  return rotation * Eigen::Quaterniond(wrist_.linear());
}

Eigen::Isometry3d ArmChain::Forward(const JointVector& q, Jacobian* jacobian) const {
  const int n = num_joints();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d anchors[kMaxArmJoints], axes[kMaxArmJoints];
  for (int i = 0; i < n; ++i) {
    const Joint& joint = joints_[i];
    position += rotation * joint.before.translation();
    rotation = (rotation * joint.before.linear()).eval();
    anchors[i] = position;
    axes[i] = rotation * joint.axis;
    rotation = (rotation * Eigen::AngleAxisd(q[i] - joint.reference, joint.axis).toRotationMatrix()).eval();
  }
  Eigen::Isometry3d wrist;
  wrist.makeAffine();
  wrist.translation() = position + rotation * wrist_.translation();
  wrist.linear() = rotation * wrist_.linear();
  if (jacobian) {
    jacobian->resize(6, n);
    for (int i = 0; i < n; ++i) {
      jacobian->col(i) << axes[i].cross(wrist.translation() - anchors[i]), axes[i];
    }
  }
  return wrist;
}

}  // namespace evalbus::policy
