#include "models/vibration.h"

#include <fmt/format.h>

#include "models/mujoco_ptr.h"

namespace evalbus {
namespace {

// Effective inertia that each actuator moves in a configuration, kg m^2 or kg.
class FeltInertia {
 public:
  FeltInertia(const mjModel& model, mjData* data) : model_(model), data_(*data) {
    // Runs only the required steps of mj_fwdPosition. Contacts are not computed, because closed fingers can
    // have very many of them.
    mj_kinematics(&model, data);
    mj_comPos(&model, data);
    mj_tendon(&model, data);
    mj_transmission(&model, data);
    mj_crb(&model, data);
    const auto n = static_cast<size_t>(model.nv);
    factor_.resize(n * n);
    mj_fullM(&model, factor_.data(), data->qM);
    mju_cholFactor(factor_.data(), model.nv, 0);
  }

  double Of(int actuator) const {
    const mjtNum* moment =
        data_.actuator_moment + static_cast<size_t>(actuator) * static_cast<size_t>(model_.nv);
    std::vector<mjtNum> solved(static_cast<size_t>(model_.nv));
    mju_cholSolve(solved.data(), factor_.data(), moment, model_.nv);
    return 1 / mju_dot(solved.data(), moment, model_.nv);
  }

 private:
  const mjModel& model_;
  const mjData& data_;
  std::vector<mjtNum> factor_;
};

}  // namespace

std::vector<std::string> FindVibration(const RobotDescription& robot, const model_info_t& info,
                                       const mjModel& model) {
  // The criterion below applies only to Euler's method.
  if (model.opt.integrator != mjINT_EULER) return {};
  const DataPtr data(mj_makeData(&model));
  for (const arm_info_t& arm : info.arm) {
    for (int j = 0; j < arm.num_joints; ++j) data->qpos[arm.joint_qpos_index[j]] = arm.joint_home_rad[j];
  }
  const FeltInertia inertia(model, data.get());
  std::vector<std::string> lines;
  const auto check = [&](const std::string& name, const std::string& who, const SourceLocation& where,
                         const std::string& mend) {
    const int id = mj_name2id(&model, mjOBJ_ACTUATOR, name.c_str());
    const double gain = -model.actuator_biasprm[mjNBIAS * id + 2];
    if (model.actuator_biastype[id] != mjBIAS_AFFINE || gain <= 0) return;
    const double felt = inertia.Of(id);
    const double step = model.opt.timestep;
    if (step * gain <= felt) return;
    lines.push_back(fmt::format(
        "{}: {} will vibrate: steps of {:.3g} ms allow a velocity gain of {:.3g}, it has {:.3g}; give {}",
        where.ToString(), who, 1000 * step, felt / step, gain, mend));
  };
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    const ArmDescription& arm = robot.arms[i];
    const GripperDescription& gripper = robot.grippers[i];
    for (const std::string& actuator : arm.actuators) {
      check(arm.prefix() + actuator, "actuator '" + actuator + "' of arm '" + arm.name + "'", arm.location,
            "position_gain_Nm_per_rad and joint_damping_Nms_per_rad");
    }
    check(gripper.prefix() + gripper.actuator,
          "the gripper's actuator '" + gripper.actuator + "' of arm '" + arm.name + "'", gripper.location,
          "a position gain and a joint damping");
  }
  return lines;
}

}  // namespace evalbus
