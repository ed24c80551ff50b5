#include "sim/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "models/model_info.h"

namespace evalbus::sim {
namespace {

int Id(const mjModel* model, mjtObj type, const std::string& name, const char* kind) {
  const int id = mj_name2id(model, type, name.c_str());
  if (id < 0) throw InputError(std::string("model has no ") + kind + " '" + name + "'");
  return id;
}

// MuJoCo clips commands to the actuator's range without a warning, so a command in the wrong unit would go
// unnoticed.
void CheckCommand(const mjModel& model, int actuator, const std::string& gripper, const char* key,
                  double command) {
  const mjtNum* range = model.actuator_ctrlrange + 2 * actuator;
  const double tolerance = 1e-6 * (range[1] - range[0]);
  if (!model.actuator_ctrllimited[actuator] ||
      (command >= range[0] - tolerance && command <= range[1] + tolerance))
    return;
  throw InputError(fmt::format("gripper '{}': {} is {:g}, expected {:g} to {:g}, the range of its actuator",
                               gripper, key, command, range[0], range[1]));
}

}  // namespace

World::World(const mjModel* model, const model_info_t& info, const RobotDescription& robot,
             const TaskDescription& task, int substeps)
    : compiled_(model),
      model_(model),
      spawn_model_(mj_copyModel(nullptr, model)),
      info_(info),
      substeps_(substeps),
      tick_us_(substeps * info.timestep_us),
      gravity_compensation_(CompensatesGravity(*model)),
      start_steps_(robot.start_steps),
      data_(mj_makeData(model)),
      stepped_qpos_(static_cast<size_t>(model->nq)),
      contact_points_(*model, info),
      forces_(contact_points_.fingers(), info.num_objects, model->opt.timestep) {
  for (const ArmDescription& description : robot.arms) {
    const std::string prefix = description.prefix();
    Arm arm;
    const arm_info_t& arm_info = info.arm[arms_.size()];
    arm.home = arm_info.joint_home_rad;
    arm.lower = arm_info.joint_lower_rad;
    arm.upper = arm_info.joint_upper_rad;
    for (const std::string& joint : description.joints) {
      const int id = Id(model, mjOBJ_JOINT, prefix + joint, "joint");
      arm.qpos.push_back(model->jnt_qposadr[id]);
      arm.dof.push_back(model->jnt_dofadr[id]);
    }
    for (size_t j = 0; j < description.actuators.size(); ++j) {
      const std::string name = prefix + description.actuators[j];
      const int id = arm.actuator.emplace_back(Id(model, mjOBJ_ACTUATOR, name, "actuator"));
      // Commands beyond the actuator's range are clipped here, because MuJoCo does not report that it clips
      // them.
      if (!model->actuator_ctrllimited[id]) continue;
      const mjtNum* range = model->actuator_ctrlrange + 2 * id;
      const double lower = std::exchange(arm.lower[j], std::max(arm.lower[j], range[0]));
      const double upper = std::exchange(arm.upper[j], std::min(arm.upper[j], range[1]));
      if (arm.lower[j] <= arm.upper[j]) continue;
      throw InputError(fmt::format(
          "actuator '{}': its range, {:g} to {:g}, contains no position of its joint, {:g} to {:g} rad", name,
          range[0], range[1], lower, upper));
    }
    arm.torque_peak.resize(arm.dof.size());
    arm.wrist_site = Id(model, mjOBJ_SITE, prefix + description.wrist_site, "site");
    arms_.push_back(std::move(arm));
  }
  for (const GripperDescription& description : robot.grippers) {
    const std::string prefix = description.prefix();
    Gripper gripper;
    for (const std::string& joint : description.joints) {
      gripper.qpos.push_back(model->jnt_qposadr[Id(model, mjOBJ_JOINT, prefix + joint, "joint")]);
    }
    gripper.actuator = Id(model, mjOBJ_ACTUATOR, prefix + description.actuator, "actuator");
    gripper.joint_open = description.joint_open;
    gripper.joint_closed = description.joint_closed;
    gripper.command_open = description.command_open;
    gripper.command_closed = description.command_closed;
    for (const auto& [key, command] :
         {std::pair("command_open", gripper.command_open), {"command_closed", gripper.command_closed}}) {
      CheckCommand(*model, gripper.actuator, description.arm, key, command);
    }
    gripper.start_opening = description.start_opening;
    gripper.binary_command = description.binary_command;
    grippers_.push_back(std::move(gripper));
  }
  for (const ScenePart& description : task.parts) {
    Part part{.name = description.name, .pose = description.pose, .may_penetrate = description.may_penetrate};
    part.body = Id(model, mjOBJ_BODY, part.name, "body");
    part.entity = info.body_entity[static_cast<size_t>(part.body)];
    part.mocap = model->body_mocapid[part.body];
    if (description.free) part.qpos = model->jnt_qposadr[model->body_jntadr[part.body]];
    if (part.mocap >= 0) {
      for (int body = 0; body < model->nbody; ++body) {
        const bool is_still = model->body_weldid[body] == 0;
        if (is_still && info.body_entity[static_cast<size_t>(body)] == part.entity) {
          spawn_model_->body_weldid[body] = part.body;
        }
      }
    }
    parts_.push_back(std::move(part));
  }
  for (const JointStart& start : task.joints) {
    const int qpos = model->jnt_qposadr[Id(model, mjOBJ_JOINT, start.joint, "joint")];
    const auto has = [qpos](const Arm& arm) { return std::ranges::find(arm.qpos, qpos) != arm.qpos.end(); };
    const auto is_known = [qpos](const Start& known) { return known.qpos == qpos; };
    // If names repeat, the first entry takes precedence.
    if (!std::ranges::any_of(arms_, has) && !std::ranges::any_of(starts_, is_known))
      starts_.push_back({qpos, start.position});
  }
}

double* World::Position(const Part& part) const {
  return part.qpos >= 0 ? data_->qpos + part.qpos : data_->mocap_pos + 3 * part.mocap;
}

double* World::Quaternion(const Part& part) const {
  return part.qpos >= 0 ? data_->qpos + part.qpos + 3 : data_->mocap_quat + 4 * part.mocap;
}

void World::SetHome() {
  mj_resetData(model_, data_.get());
  for (const Arm& arm : arms_) {
    for (size_t j = 0; j < arm.qpos.size(); ++j) {
      data_->qpos[arm.qpos[j]] = arm.home[j];
      data_->ctrl[arm.actuator[j]] = arm.home[j];
    }
  }
  for (const Gripper& gripper : grippers_) {
    const double opening = gripper.start_opening;
    for (const int qpos : gripper.qpos)
      data_->qpos[qpos] = std::lerp(gripper.joint_closed, gripper.joint_open, opening);
    data_->ctrl[gripper.actuator] = std::lerp(gripper.command_closed, gripper.command_open, opening);
  }
  for (const Start& start : starts_) data_->qpos[start.qpos] = start.position;
  for (const Part& part : parts_) {
    if (!part.is_movable()) continue;
    std::copy(part.pose.position.begin(), part.pose.position.end(), Position(part));
    std::copy(part.pose.quaternion.begin(), part.pose.quaternion.end(), Quaternion(part));
  }
}

std::string World::Apply(const action_t& action) {
  size_t num_joints = 0;
  for (const Arm& arm : arms_) num_joints += arm.qpos.size();
  if (action.mode != action_t::JOINT_POSITION)
    return "action mode " + std::to_string(action.mode) + " is unknown, expected " +
           std::to_string(action_t::JOINT_POSITION) + " (JOINT_POSITION)";
  if (action.joint_position_rad.size() != num_joints || action.gripper_closing.size() != grippers_.size()) {
    return "action has " + std::to_string(action.joint_position_rad.size()) + " joint and " +
           std::to_string(action.gripper_closing.size()) + " gripper values, expected " +
           std::to_string(num_joints) + " and " + std::to_string(grippers_.size());
  }
  const auto finite = [](double x) { return std::isfinite(x); };
  if (!std::all_of(action.joint_position_rad.begin(), action.joint_position_rad.end(), finite) ||
      !std::all_of(action.gripper_closing.begin(), action.gripper_closing.end(), finite)) {
    return "the action contains NaN or infinity";
  }
  unreachable_poses_ += action.unreachable_poses;
  singular_poses_ += action.singular_poses;
  const auto clip = [this](double value, double lower, double upper) {
    if (value < lower || value > upper) ++action_clips_;
    return std::clamp(value, lower, upper);
  };
  size_t next = 0;
  for (const Arm& arm : arms_) {
    for (size_t j = 0; j < arm.qpos.size(); ++j) {
      data_->ctrl[arm.actuator[j]] = clip(action.joint_position_rad[next++], arm.lower[j], arm.upper[j]);
    }
  }
  for (size_t i = 0; i < grippers_.size(); ++i) {
    const Gripper& gripper = grippers_[i];
    double closing = clip(action.gripper_closing[i], 0, 1);
    // RoboEval's gripper closes for commands of at least 0.5.
    if (gripper.binary_command) closing = closing < 0.5 ? 0 : 1;
    data_->ctrl[gripper.actuator] =
        gripper.command_open + closing * (gripper.command_closed - gripper.command_open);
  }
  return {};
}

void World::Prepare() {
  std::copy(data_->qpos, data_->qpos + model_->nq, stepped_qpos_.begin());
  mj_step1(model_, data_.get());
  for (const Arm& arm : arms_) {
    if (!gravity_compensation_) break;
    for (const int dof : arm.dof) data_->qfrc_applied[dof] = data_->qfrc_bias[dof];
  }
  for (const int dof : parked_dofs_) data_->qfrc_applied[dof] = data_->qfrc_bias[dof];
}

void World::AddWork() {
  for (Arm& arm : arms_) {
    double power = 0;
    for (size_t j = 0; j < arm.dof.size(); ++j) {
      const int dof = arm.dof[j];
      power += data_->qfrc_actuator[dof] * data_->qvel[dof];
      // The applied force is gravity compensation.
      const double torque = std::abs(data_->qfrc_actuator[dof] + data_->qfrc_applied[dof]);
      arm.torque_peak[j] = std::max(arm.torque_peak[j], torque);
    }
    arm.work += std::abs(power) * model_->opt.timestep;
  }
}

void World::MakeStartSteps() {
  if (start_steps_ == 0) return;
  const std::vector<double> start(data_->qpos, data_->qpos + model_->nq);
  for (int i = 0; i < start_steps_; ++i) mj_step(model_, data_.get());
  const auto is_robot = [this](int joint) {
    const int entity = info_.body_entity[static_cast<size_t>(model_->jnt_bodyid[joint])];
    return info_.entity_kind[static_cast<size_t>(entity)] == model_info_t::ROBOT;
  };
  for (int joint = 0; joint < model_->njnt; ++joint) {
    // The robot keeps the motion. All other joints are reset; such a joint may have several coordinates.
    if (is_robot(joint)) continue;
    const int qpos = model_->jnt_qposadr[joint], dof = model_->jnt_dofadr[joint];
    const int next_qpos = joint + 1 < model_->njnt ? model_->jnt_qposadr[joint + 1] : model_->nq;
    const int next_dof = joint + 1 < model_->njnt ? model_->jnt_dofadr[joint + 1] : model_->nv;
    std::copy(start.begin() + qpos, start.begin() + next_qpos, data_->qpos + qpos);
    std::fill(data_->qvel + dof, data_->qvel + next_dof, 0);
  }
  data_->time = 0;
}

bool World::Step() {
  forces_.StartTick();
  for (Arm& arm : arms_) std::ranges::fill(arm.torque_peak, 0);
  for (int i = 0; i < substeps_; ++i) {
    contact_points_.BeforeStep(*model_, data_.get(), forces_);
    mj_step2(model_, data_.get());
    forces_.AddStep(contact_points_.AfterStep(*model_, *data_));
    AddWork();
    Prepare();
    if (!IsStable()) return false;
  }
  return true;
}

bool World::IsStable() {
  for (int i = 0; i < mjNWARNING; ++i) {
    // After any warning, MuJoCo no longer simulates the requested physics.
    if (data_->warning[i].number == 0) continue;
    instability_ = mju_warningText(i, static_cast<size_t>(data_->warning[i].lastinfo));
    return false;
  }
  return true;
}

void World::Fill(state_t* state) const {
  const mjData& d = *data_;
  state->num_qpos = model_->nq;
  state->qpos_mixed.assign(d.qpos, d.qpos + model_->nq);
  state->num_qvel = model_->nv;
  state->qvel_mixed.assign(d.qvel, d.qvel + model_->nv);
  state->num_ctrl = model_->nu;
  state->ctrl_mixed.assign(d.ctrl, d.ctrl + model_->nu);
  state->num_bodies = model_->nbody;
  state->body.resize(static_cast<size_t>(model_->nbody));
  for (int i = 0; i < model_->nbody; ++i) {
    body_pose_t& body = state->body[static_cast<size_t>(i)];
    mju_copy3(body.position_m, d.xpos + 3 * i);
    mju_copy4(body.quat_wxyz, d.xquat + 4 * i);
  }
  state->num_arms = static_cast<int32_t>(arms_.size());
  state->arm.resize(arms_.size());
  for (size_t i = 0; i < arms_.size(); ++i) {
    const Arm& arm = arms_[i];
    arm_state_t& out = state->arm[i];
    out.num_joints = static_cast<int32_t>(arm.qpos.size());
    out.joint_position_rad.resize(arm.qpos.size());
    out.joint_velocity_radps.resize(arm.qpos.size());
    out.joint_torque_Nm.resize(arm.qpos.size());
    out.joint_torque_peak_Nm = arm.torque_peak;
    out.joint_command_rad.resize(arm.qpos.size());
    for (size_t j = 0; j < arm.qpos.size(); ++j) {
      out.joint_position_rad[j] = d.qpos[arm.qpos[j]];
      out.joint_velocity_radps[j] = d.qvel[arm.dof[j]];
      out.joint_torque_Nm[j] = d.qfrc_actuator[arm.dof[j]];
      out.joint_command_rad[j] = d.ctrl[arm.actuator[j]];
    }
    out.mechanical_work_J = arm.work;
    std::copy_n(d.site_xpos + 3 * arm.wrist_site, 3, out.wrist_position_m);
    mju_mat2Quat(out.wrist_quat_wxyz, d.site_xmat + 9 * arm.wrist_site);
  }
  state->num_grippers = static_cast<int32_t>(grippers_.size());
  state->gripper.resize(grippers_.size());
  for (size_t i = 0; i < grippers_.size(); ++i) {
    const Gripper& gripper = grippers_[i];
    double sum = 0;
    for (const int qpos : gripper.qpos) {
      sum += (d.qpos[qpos] - gripper.joint_closed) / (gripper.joint_open - gripper.joint_closed);
    }
    state->gripper[i].opening = std::clamp(sum / static_cast<double>(gripper.qpos.size()), 0.0, 1.0);
    state->gripper[i].closing_command =
        (d.ctrl[gripper.actuator] - gripper.command_open) / (gripper.command_closed - gripper.command_open);
  }
  forces_.Fill(state);
  state->action_clips = action_clips_;
  state->unreachable_poses = unreachable_poses_;
  state->singular_poses = singular_poses_;
}

}  // namespace evalbus::sim
