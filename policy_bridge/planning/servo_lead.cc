#include "policy_bridge/planning/servo_lead.h"

#include <algorithm>

#include "models/model_info.h"

namespace evalbus::policy {

namespace {

// Returns the index of the joint whose coordinate in qpos has this index.
int JointAt(const mjModel& model, int qpos) {
  const int* begin = model.jnt_qposadr;
  return static_cast<int>(std::find(begin, begin + model.njnt, qpos) - begin);
}

}  // namespace

ServoLead::ServoLead(const mjModel& model, const model_info_t& info) {
  if (!CompensatesGravity(model)) {
    model_.reset(mj_copyModel(nullptr, &model));
    data_.reset(mj_makeData(&model));
    gravity_.resize(static_cast<size_t>(model.nv));
  }
  for (const arm_info_t& arm : info.arm) {
    std::vector<Servo>& servos = servos_.emplace_back();
    for (const int qpos : arm.joint_qpos_index) {
      const int joint = JointAt(model, qpos);
      Servo servo{.qpos = qpos, .dof = model.jnt_dofadr[joint]};
      for (int actuator = 0; actuator < model.nu; ++actuator) {
        if (model.actuator_trntype[actuator] != mjTRN_JOINT || model.actuator_trnid[2 * actuator] != joint ||
            model.actuator_biastype[actuator] != mjBIAS_AFFINE) {
          continue;
        }
        servo.stiffness = -model.actuator_biasprm[mjNBIAS * actuator + 1];
        servo.damping = -model.actuator_biasprm[mjNBIAS * actuator + 2];
      }
      servos.push_back(servo);
    }
  }
}

void ServoLead::Lead(const std::vector<JointVector>& wanted, const std::vector<JointVector>& velocity,
                     std::vector<JointVector>* targets) {
  if (data_) {
    for (size_t arm = 0; arm < servos_.size(); ++arm) {
      for (size_t j = 0; j < servos_[arm].size(); ++j) {
        data_->qpos[servos_[arm][j].qpos] = wanted[arm][static_cast<Eigen::Index>(j)];
      }
    }
    mj_kinematics(model_.get(), data_.get());
    mj_comPos(model_.get(), data_.get());
    mj_rne(model_.get(), data_.get(), 0, gravity_.data());
  }
  *targets = wanted;
  for (size_t arm = 0; arm < servos_.size(); ++arm) {
    for (size_t j = 0; j < servos_[arm].size(); ++j) {
      const Servo& servo = servos_[arm][j];
      if (servo.stiffness <= 0) continue;
      const auto i = static_cast<Eigen::Index>(j);
      const double weight = data_ ? gravity_[static_cast<size_t>(servo.dof)] : 0;
      (*targets)[arm][i] += (servo.damping * velocity[arm][i] + weight) / servo.stiffness;
    }
  }
}

}  // namespace evalbus::policy
