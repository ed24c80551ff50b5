#include "sim/measured_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/angles.h"
#include "base/errors.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "models/farthest.h"
#include "sim/world.h"

namespace evalbus::sim {
namespace {

// Distance by which a joint may be beyond its range: kBeyondRange (rad or m); for a joint of an object, the
// fraction kBeyondRangeOfObject of its range if that is more.
constexpr double kBeyondRange = 0.05, kBeyondRangeOfObject = 0.05;
// A joint of an object that is beyond its range by more than this (rad or m) is counted.
constexpr double kCountedBeyondRange = 1e-3;
// Plausibility limit of velocities, m/s or rad/s. Positions of joints without limits may be up to kFarthest
// (m or rad).
constexpr double kFastest = 1e6;

bool Has(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

int JointId(const mjModel* model, const std::string& name) {
  return mj_name2id(model, mjOBJ_JOINT, name.c_str());
}

// Returns true if the object's pose can be set: it has a free joint or is a mocap body.
bool IsMovable(const mjModel* model, const std::string& object) {
  const int body = mj_name2id(model, mjOBJ_BODY, object.c_str());
  const bool is_free =
      model->body_jntnum[body] > 0 && model->jnt_type[model->body_jntadr[body]] == mjJNT_FREE;
  return is_free || model->body_mocapid[body] >= 0;
}

// Returns true if everything that determines the object's pose is measured.
bool IsTracked(const PreparedScene& prepared, const Measured& measured, const std::string& object) {
  const model_info_t& info = prepared.info;
  bool tracked = Has(measured.objects, object) == IsMovable(prepared.scene.physics.get(), object);
  for (const std::string& joint : info.joint_name) {
    if (joint.starts_with(object + "/")) tracked = tracked && Has(measured.joints, joint);
  }
  return tracked;
}

std::string DistanceFault(const std::string& object, const double (&position)[3], double farthest) {
  if (std::ranges::all_of(position, [&](double at) { return std::abs(at) <= farthest; })) return "";
  return fmt::format(
      "the position of {} is {:.4g}, {:.4g}, {:.4g} m, expected at most {:g} m from the origin", object,
      position[0], position[1], position[2], farthest);
}

}  // namespace

std::optional<MeasuredScene::Fault> MeasuredScene::FindFault(const PreparedScene& prepared,
                                                             const Measured& measured) {
  const model_info_t& info = prepared.info;
  const mjModel* model = prepared.scene.physics.get();
  const auto is_twice = [](const std::vector<std::string>& names, size_t k) {
    return std::find(names.begin(), names.begin() + static_cast<ptrdiff_t>(k), names[k]) !=
           names.begin() + static_cast<ptrdiff_t>(k);
  };
  for (size_t k = 0; k < measured.joints.size(); ++k) {
    const std::string& name = measured.joints[k];
    const int joint = JointId(model, name);
    if (joint < 0 || !(model->jnt_type[joint] == mjJNT_HINGE || model->jnt_type[joint] == mjJNT_SLIDE)) {
      return Fault{name, "there is no joint '" + Printable(name) + "'" + Suggestion(name, info.joint_name)};
    }
    if (is_twice(measured.joints, k)) return Fault{name, "joint '" + name + "' is given twice"};
  }
  for (const arm_info_t& arm : info.arm) {
    for (const std::string& joint : arm.joint_name) {
      if (Has(measured.joints, joint)) continue;
      return Fault{joint, "joint '" + joint + "' is missing; all joints of the arms are required"};
    }
  }
  for (size_t k = 0; k < measured.objects.size(); ++k) {
    const std::string& name = measured.objects[k];
    if (!Has(info.object_name, name)) {
      return Fault{name, "there is no object '" + Printable(name) + "'" + Suggestion(name, info.object_name)};
    }
    if (!IsMovable(model, name)) {
      return Fault{name, "'" + name + "' is fixed in this task; only its joints are measured"};
    }
    if (is_twice(measured.objects, k)) return Fault{name, "object '" + name + "' is given twice"};
  }
  return std::nullopt;
}

MeasuredScene::MeasuredScene(PreparedScene* prepared, Measured measured, const std::string& source)
    : prepared_(prepared), model_(prepared->scene.physics.get()), measured_(std::move(measured)) {
  if (const auto fault = FindFault(*prepared, measured_)) throw InputError(fault->text);
  model_info_t& info = prepared->info;
  info.source = source;
  info.has_physics = 0;
  info.has_velocity = measured_.has_velocity;
  for (int k = 0; k < info.num_objects; ++k) {
    info.object_is_tracked[k] = IsTracked(*prepared, measured_, info.object_name[k]);
  }
  for (const std::string& name : measured_.joints) {
    joints_.push_back(JointId(model_, name));
    is_of_object_.push_back(std::ranges::any_of(
        info.object_name, [&](const std::string& object) { return name.starts_with(object + "/"); }));
  }
  fingers_.resize(info.gripper.size());
  for (size_t k = 0; k < fingers_.size(); ++k) {
    for (const std::string& joint : gripper(k).joints) {
      const auto found = std::ranges::find(measured_.joints, gripper(k).prefix() + joint);
      if (found != measured_.joints.end()) {
        fingers_[k].push_back(static_cast<size_t>(found - measured_.joints.begin()));
      }
    }
  }
  World world(model_, info, prepared->robot, prepared->task, info.substeps);
  world.Reset(0, Variation{});
  home_.reset(mj_copyData(nullptr, model_, &world.data()));
  data_.reset(mj_makeData(model_));
}

std::string MeasuredScene::PositionFault(size_t joint, double position) const {
  const int id = joints_[joint];
  if (!std::isfinite(position))
    return fmt::format("{} is {}, expected a finite number", measured_.joints[joint], position);
  const double lower = model_->jnt_range[2 * id], upper = model_->jnt_range[2 * id + 1];
  const double tolerance =
      is_of_object_[joint] ? std::max(kBeyondRange, kBeyondRangeOfObject * (upper - lower)) : kBeyondRange;
  const auto is_within = [&](double q) { return q >= lower - tolerance && q <= upper + tolerance; };
  if (!model_->jnt_limited[id]) {
    return std::abs(position) <= kFarthest
               ? ""
               : fmt::format("{} is at {:.4g} {}, expected at most {:g}", measured_.joints[joint], position,
                             slides(joint) ? "m" : "rad", kFarthest);
  }
  if (is_within(position)) return "";
  return fmt::format("{:.4g} {} is beyond the range of {}, {:.3f} to {:.3f}{}", position,
                     slides(joint) ? "m" : "rad", measured_.joints[joint], lower, upper,
                     !slides(joint) && is_within(position * kDegree) ? "; are these degrees?" : "");
}

std::string MeasuredScene::SampleFault(const Sample& sample) const {
  for (size_t k = 0; k < sample.position.size(); ++k) {
    if (const std::string fault = PositionFault(k, sample.position[k]); !fault.empty()) return fault;
  }
  for (size_t k = 0; k < sample.velocity.size(); ++k) {
    if (std::abs(sample.velocity[k]) <= kFastest) continue;
    return fmt::format("the velocity of {} is {:.4g} {}, expected at most {:g}", measured_.joints[k],
                       sample.velocity[k], slides(k) ? "m/s" : "rad/s", kFastest);
  }
  for (size_t k = 0; k < sample.object.size(); ++k) {
    const auto& [position, quat] = sample.object[k];
    if (const std::string fault = DistanceFault(measured_.objects[k], position, kFarthest); !fault.empty())
      return fault;
    const double norm = std::hypot(std::hypot(quat[0], quat[1]), std::hypot(quat[2], quat[3]));
    if (std::abs(norm - 1) <= 0.01) continue;
    return fmt::format("the quaternion of '{}' has norm {:.3g}, expected 1", measured_.objects[k], norm);
  }
  return "";
}

std::string MeasuredScene::FirstSampleFault(const Sample& sample) const {
  for (size_t k = 0; k < sample.object.size(); ++k) {
    const std::string fault = DistanceFault(measured_.objects[k], sample.object[k].position_m, kFarthestPart);
    if (!fault.empty()) return fault;
  }
  return "";
}

std::string MeasuredScene::BeyondRange(const Sample& sample) const {
  size_t furthest = 0;
  double most = kCountedBeyondRange;
  for (size_t k = 0; k < joints_.size(); ++k) {
    if (!is_of_object_[k] || !model_->jnt_limited[joints_[k]]) continue;
    const double *range = model_->jnt_range + 2 * joints_[k], q = sample.position[k];
    const double beyond = std::max(range[0] - q, q - range[1]);
    if (beyond <= most) continue;
    most = beyond;
    furthest = k;
  }
  if (most == kCountedBeyondRange) return "";
  return fmt::format("{} is beyond its range by {:.3g} {}", measured_.joints[furthest], most,
                     slides(furthest) ? "m" : "rad");
}

void MeasuredScene::SetObjects(const Sample& a, const Sample& b, double share) {
  mjData& d = *data_;
  for (size_t k = 0; k < a.object.size(); ++k) {
    const int body = mj_name2id(model_, mjOBJ_BODY, measured_.objects[k].c_str());
    const int mocap = model_->body_mocapid[body];
    double* position =
        mocap >= 0 ? d.mocap_pos + 3 * mocap : d.qpos + model_->jnt_qposadr[model_->body_jntadr[body]];
    double* quaternion = mocap >= 0 ? d.mocap_quat + 4 * mocap : position + 3;
    const body_pose_t &from = a.object[k], &to = b.object[k];
    for (size_t i = 0; i < 3; ++i) {
      position[i] = from.position_m[i] + share * (to.position_m[i] - from.position_m[i]);
    }
    // q and -q are the same rotation. Their sign is chosen such that the interpolation takes the shorter way.
    double dot = 0;
    for (size_t i = 0; i < 4; ++i) dot += from.quat_wxyz[i] * to.quat_wxyz[i];
    for (size_t i = 0; i < 4; ++i) {
      quaternion[i] = from.quat_wxyz[i] + share * ((dot < 0 ? -1 : 1) * to.quat_wxyz[i] - from.quat_wxyz[i]);
    }
    mju_normalize4(quaternion);
  }
}

std::string BeyondRangeText(int64_t samples, const std::string& first) {
  return Plural(samples, "sample") + " with a joint of an object beyond its soft limits, the first: " + first;
}

state_t MeasuredScene::At(const Sample& a, const Sample& b, double share, const state_t* before,
                          const header_t& header) {
  const model_info_t& info = prepared_->info;
  mjData& d = *data_;
  mju_copy(d.qpos, home_->qpos, model_->nq);
  mju_zero(d.qvel, model_->nv);
  mju_copy(d.mocap_pos, home_->mocap_pos, 3 * model_->nmocap);
  mju_copy(d.mocap_quat, home_->mocap_quat, 4 * model_->nmocap);
  const auto between = [share](double from, double to) { return from + share * (to - from); };
  // The time is computed from ticks, because the header's times are rounded to microseconds.
  const double elapsed =
      before ? static_cast<double>(header.tick - before->header.tick) * ControlPeriod(info) : 0;
  for (size_t k = 0; k < joints_.size(); ++k) {
    const int qpos = model_->jnt_qposadr[joints_[k]], dof = model_->jnt_dofadr[joints_[k]];
    d.qpos[qpos] = between(a.position[k], b.position[k]);
    if (measured_.has_velocity) {
      d.qvel[dof] = between(a.velocity[k], b.velocity[k]);
    } else if (before) {
      d.qvel[dof] = (d.qpos[qpos] - before->qpos_mixed[static_cast<size_t>(qpos)]) / elapsed;
    }
  }
  state_t state{};
  for (size_t k = 0; k < fingers_.size(); ++k) {
    const GripperDescription& its = gripper(k);
    double opening = 0;
    if (a.opening[k]) {
      opening = between(*a.opening[k], *b.opening[k]);
    } else {
      for (const size_t finger : fingers_[k]) {
        const double q = d.qpos[model_->jnt_qposadr[joints_[finger]]];
        opening += (q - its.joint_closed) / (its.joint_open - its.joint_closed) /
                   static_cast<double>(fingers_[k].size());
      }
    }
    opening = std::clamp(opening, 0.0, 1.0);
    state.gripper.emplace_back().opening = opening;
    for (const std::string& joint : its.joints) {
      const std::string name = its.prefix() + joint;
      if (Has(measured_.joints, name)) continue;
      d.qpos[model_->jnt_qposadr[JointId(model_, name)]] =
          its.joint_closed + opening * (its.joint_open - its.joint_closed);
    }
  }
  SetObjects(a, b, share);
  mj_kinematics(model_, &d);

  state.header = header;
  state.num_qpos = model_->nq;
  state.qpos_mixed.assign(d.qpos, d.qpos + model_->nq);
  state.num_qvel = model_->nv;
  state.qvel_mixed.assign(d.qvel, d.qvel + model_->nv);
  state.num_bodies = model_->nbody;
  state.body.resize(static_cast<size_t>(model_->nbody));
  for (int i = 0; i < model_->nbody; ++i) {
    mju_copy3(state.body[static_cast<size_t>(i)].position_m, d.xpos + 3 * i);
    mju_copy4(state.body[static_cast<size_t>(i)].quat_wxyz, d.xquat + 4 * i);
  }
  state.num_grippers = static_cast<int32_t>(state.gripper.size());
  for (const arm_info_t& arm : info.arm) {
    arm_state_t& out = state.arm.emplace_back();
    out.num_joints = arm.num_joints;
    for (const std::string& joint : arm.joint_name) {
      const int id = JointId(model_, joint);
      out.joint_position_rad.push_back(d.qpos[model_->jnt_qposadr[id]]);
      out.joint_velocity_radps.push_back(d.qvel[model_->jnt_dofadr[id]]);
    }
    for (auto* unknown : {&out.joint_torque_Nm, &out.joint_torque_peak_Nm, &out.joint_command_rad}) {
      unknown->assign(static_cast<size_t>(arm.num_joints), 0);
    }
    const int site = mj_name2id(model_, mjOBJ_SITE, arm.wrist_site.c_str());
    mju_copy3(out.wrist_position_m, d.site_xpos + 3 * site);
    mju_mat2Quat(out.wrist_quat_wxyz, d.site_xmat + 9 * site);
  }
  state.num_arms = static_cast<int32_t>(state.arm.size());
  return state;
}

}  // namespace evalbus::sim
