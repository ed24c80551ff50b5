#include "policy_bridge/planning/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "base/errors.h"

namespace evalbus::policy {
namespace {

constexpr int kMaxContacts = 2000;

// The geoms of a finger whose distance from the tip, along the approach direction, is at most this form the
// finger's pad.
constexpr double kPadLength = 0.015;  // m

// Returns the grip frame: its origin is midway between the pads of a gripper, and y is the direction in which
// they close. A pad may consist of several geoms, and its finger also has other geoms. Therefore the mean
// position of the geoms near the tip counts as the position of the pad.
Eigen::Isometry3d GripFrame(const mjModel& model, const mjData& data, const gripper_info_t& gripper,
                            const Eigen::Isometry3d& wrist) {
  const Eigen::Vector3d approach = wrist.linear().col(2);
  std::map<int, std::vector<Eigen::Vector3d>> geoms_of_body;
  for (int geom : gripper.pad_geom) {
    geoms_of_body[model.geom_bodyid[geom]].emplace_back(data.geom_xpos + 3 * geom);
  }
  std::vector<Eigen::Vector3d> pads;
  for (const auto& [body, geoms] : geoms_of_body) {
    double tip = approach.dot(geoms[0]);
    for (const Eigen::Vector3d& geom : geoms) tip = std::max(tip, approach.dot(geom));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const Eigen::Vector3d& geom : geoms) {
      if (approach.dot(geom) < tip - kPadLength) continue;
      sum += geom;
      ++count;
    }
    pads.emplace_back(sum / count);
  }
  if (pads.size() != 2) {
    throw InputError("gripper \"" + gripper.name + "\": expected two fingers with pads, got " +
                     std::to_string(pads.size()));
  }
  const Eigen::Vector3d between = pads[0] - pads[1];
  const Eigen::Vector3d closing = (between - approach * approach.dot(between)).normalized();
  Eigen::Isometry3d grip;
  grip.makeAffine();
  grip.linear() << closing.cross(approach), closing, approach;
  grip.translation() = (pads[0] + pads[1]) / 2;
  return wrist.inverse() * grip;
}

}  // namespace

std::vector<int> ClosedGrippers(const Configuration& configuration) {
  std::vector<int> closed;
  for (size_t i = 0; i < configuration.closing.size(); ++i) {
    if (configuration.closing[i] > 0) closed.push_back(static_cast<int>(i));
  }
  return closed;
}

size_t CountJoints(const model_info_t& info) {
  size_t count = 0;
  for (const arm_info_t& arm : info.arm) count += static_cast<size_t>(arm.num_joints);
  return count;
}

Configuration HomeConfiguration(const model_info_t& info) {
  Configuration home;
  for (const arm_info_t& arm : info.arm) {
    home.joints.push_back(Eigen::Map<const Eigen::VectorXd>(arm.joint_home_rad.data(), arm.num_joints));
  }
  home.closing.assign(info.gripper.size(), 0.0);
  return home;
}

std::vector<Arm> MakeArms(const mjModel& model, const model_info_t& info) {
  const DataPtr data(mj_makeData(&model));
  // The gripper is half open, so that the line between the two pads has a direction.
  for (int joint = 0; joint < model.njnt; ++joint) {
    if (model.jnt_type[joint] == mjJNT_SLIDE || model.jnt_type[joint] == mjJNT_HINGE) {
      const mjtNum* range = model.jnt_range + 2 * joint;
      if (model.jnt_limited[joint]) data->qpos[model.jnt_qposadr[joint]] = (range[0] + range[1]) / 2;
    }
  }
  mj_kinematics(&model, data.get());
  std::vector<Arm> arms;
  for (size_t i = 0; i < info.arm.size(); ++i) {
    const arm_info_t& arm = info.arm[i];
    const auto gripper = std::find_if(info.gripper.begin(), info.gripper.end(),
                                      [&](const gripper_info_t& g) { return g.arm == static_cast<int>(i); });
    if (gripper == info.gripper.end() || gripper - info.gripper.begin() != static_cast<std::ptrdiff_t>(i)) {
      throw InputError("arm \"" + arm.name +
                       "\": expected a gripper of its own, listed in the order of the arms");
    }
    ArmChain chain(model, arm);
    JointVector q(arm.num_joints);
    for (int j = 0; j < arm.num_joints; ++j) q[j] = data->qpos[arm.joint_qpos_index[j]];
    const Eigen::Isometry3d wrist = chain.Forward(q);
    arms.push_back({std::move(chain), GripFrame(model, *data, *gripper, wrist)});
  }
  return arms;
}

int ObjectBody(const model_info_t& info, const std::string& object) {
  const auto found = std::find(info.object_name.begin(), info.object_name.end(), object);
  if (found != info.object_name.end()) {
    const int entity = info.object_entity[found - info.object_name.begin()];
    const auto body = std::find(info.body_entity.begin(), info.body_entity.end(), entity);
    if (body != info.body_entity.end()) return static_cast<int>(body - info.body_entity.begin());
  }
  throw InputError("the task has no object \"" + object + "\"");
}

Eigen::Isometry3d BodyPose(const state_t& state, int body) {
  const size_t needed = static_cast<size_t>(body) + 1;
  if (state.body.size() < needed) {
    throw std::runtime_error("the state has " + std::to_string(state.body.size()) +
                             " bodies, fewer than the model");
  }
  return ToPose(state.body[body].position_m, state.body[body].quat_wxyz);
}

int BodyId(const mjModel& model, const std::string& name) {
  const int body = mj_name2id(&model, mjOBJ_BODY, name.c_str());
  if (body < 0) throw InputError("the model has no body \"" + name + "\"");
  return body;
}

Eigen::Isometry3d SiteInBody(const mjModel& model, const std::string& site, int body) {
  const int id = mj_name2id(&model, mjOBJ_SITE, site.c_str());
  if (id < 0) throw InputError("the model has no site \"" + site + "\"");
  Eigen::Isometry3d pose = ToPose(model.site_pos + 3 * id, model.site_quat + 4 * id);
  for (int b = model.site_bodyid[id]; b != body; b = model.body_parentid[b]) {
    if (b == 0 || model.body_jntnum[b] > 0) {
      throw InputError("site \"" + site + "\" is not rigidly attached to the object");
    }
    pose = ToPose(model.body_pos + 3 * b, model.body_quat + 4 * b) * pose;
  }
  return pose;
}

ContactProbe::ContactProbe(const mjModel& model, const model_info_t& info, double clearance_m)
    : model_(mj_copyModel(nullptr, &model)), clearance_(clearance_m) {
  for (int geom = 0; geom < model_->ngeom; ++geom) {
    // MuJoCo reports a contact if the distance of a pair is below the larger of its two margins.
    model_->geom_margin[geom] = std::max(model_->geom_margin[geom], clearance_m);
    const int entity = info.body_entity[info.geom_body[geom]];
    entity_of_geom_.push_back(entity);
    const auto arm = std::find_if(info.arm.begin(), info.arm.end(),
                                  [&](const arm_info_t& candidate) { return candidate.entity == entity; });
    arm_of_geom_.push_back(arm == info.arm.end() ? -1 : static_cast<int>(arm - info.arm.begin()));
    is_pad_.push_back(false);
  }
  // MuJoCo must not drop any contact. There are many, because the margins are enlarged and closed fingers
  // touch in many places.
  model_->nconmax = std::max(model_->nconmax, kMaxContacts);
  data_.reset(mj_makeData(model_.get()));
  entity_of_body_ = info.body_entity;
  for (const arm_info_t& arm : info.arm) arm_qpos_.push_back(arm.joint_qpos_index);
  for (const gripper_info_t& gripper : info.gripper) {
    for (int geom : gripper.pad_geom) is_pad_[geom] = true;
  }
  FindNearAtHome(info);
}

void ContactProbe::FindNearAtHome(const model_info_t& info) {
  for (size_t arm = 0; arm < info.arm.size(); ++arm) {
    SetArm(static_cast<int>(arm),
           Eigen::Map<const Eigen::VectorXd>(info.arm[arm].joint_home_rad.data(), info.arm[arm].num_joints));
  }
  mj_kinematics(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
  for (int i = 0; i < data_->ncon; ++i) {
    const int a = data_->contact[i].geom1, b = data_->contact[i].geom2;
    if (arm_of_geom_[a] >= 0 && arm_of_geom_[a] == arm_of_geom_[b]) near_at_home_.insert(BodiesOf(a, b));
  }
}

std::pair<int, int> ContactProbe::BodiesOf(int geom, int other) const {
  return std::minmax({model_->geom_bodyid[geom], model_->geom_bodyid[other]});
}

void ContactProbe::Set(const state_t& state) {
  if (state.qpos_mixed.size() != static_cast<size_t>(model_->nq)) {
    throw std::runtime_error("the state has " + std::to_string(state.qpos_mixed.size()) +
                             " coordinates, the model " + std::to_string(model_->nq));
  }
  std::copy(state.qpos_mixed.begin(), state.qpos_mixed.end(), data_->qpos);
  for (int body = 0; body < model_->nbody; ++body) {
    if (model_->body_mocapid[body] >= 0) SetMocap(body, BodyPose(state, body));
  }
}

void ContactProbe::SetArm(int arm, const JointVector& q) {
  for (Eigen::Index i = 0; i < q.size(); ++i) data_->qpos[arm_qpos_[arm][i]] = q[i];
}

void ContactProbe::SetMocap(int body, const Eigen::Isometry3d& pose) {
  const int mocap = model_->body_mocapid[body];
  const Eigen::Quaterniond quat(pose.linear());
  const double values[] = {quat.w(), quat.x(), quat.y(), quat.z()};
  std::copy_n(pose.translation().data(), 3, data_->mocap_pos + 3 * mocap);
  std::copy_n(values, 4, data_->mocap_quat + 4 * mocap);
}

void ContactProbe::SetObject(int body, const Eigen::Isometry3d& pose) {
  if (model_->body_jntnum[body] != 1 || model_->jnt_type[model_->body_jntadr[body]] != mjJNT_FREE) {
    throw InputError("an object that is not free cannot be carried");
  }
  mjtNum* qpos = data_->qpos + model_->jnt_qposadr[model_->body_jntadr[body]];
  const Eigen::Quaterniond quat(pose.linear());
  for (int i = 0; i < 3; ++i) qpos[i] = pose.translation()[i];
  qpos[3] = quat.w();
  qpos[4] = quat.x();
  qpos[5] = quat.y();
  qpos[6] = quat.z();
}

void ContactProbe::SetAngle(const Hinge& hinge, double angle) { data_->qpos[hinge.qpos] = angle; }

Hinge ContactProbe::HingeOf(int body, const state_t& state) const {
  const int joint = model_->body_jntadr[body];
  if (model_->body_jntnum[body] != 1 || model_->jnt_type[joint] != mjJNT_HINGE ||
      !model_->jnt_limited[joint]) {
    throw InputError("body \"" + std::string(model_->names + model_->name_bodyadr[body]) +
                     "\": expected one joint, a hinge with a range");
  }
  const Eigen::Isometry3d pose = BodyPose(state, body);
  Hinge hinge;
  hinge.point = pose * Eigen::Vector3d(model_->jnt_pos + 3 * joint);
  hinge.direction = pose.linear() * Eigen::Vector3d(model_->jnt_axis + 3 * joint);
  hinge.lower = model_->jnt_range[2 * joint];
  hinge.upper = model_->jnt_range[2 * joint + 1];
  hinge.qpos = model_->jnt_qposadr[joint];
  hinge.angle = state.qpos_mixed.at(static_cast<size_t>(hinge.qpos));
  return hinge;
}

std::optional<Touch> ContactProbe::FindTouch(const std::vector<int>& arms,
                                             const std::vector<int>& allowed_contact_bodies) {
  mj_kinematics(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
  const auto is_allowed_contact = [&](int geom) {
    return std::any_of(allowed_contact_bodies.begin(), allowed_contact_bodies.end(),
                       [&](int body) { return entity_of_body_[body] == entity_of_geom_[geom]; });
  };
  const auto is_named = [&](int geom) {
    return std::find(arms.begin(), arms.end(), arm_of_geom_[geom]) != arms.end();
  };
  for (int i = 0; i < data_->ncon; ++i) {
    const int a = data_->contact[i].geom1, b = data_->contact[i].geom2;
    const bool a_named = is_named(a), b_named = is_named(b);
    if (!a_named && !b_named) continue;
    if ((arm_of_geom_[a] >= 0 && !a_named) || (arm_of_geom_[b] >= 0 && !b_named)) continue;
    if (is_pad_[a] && (is_pad_[b] || is_allowed_contact(b))) continue;
    if (is_pad_[b] && is_allowed_contact(a)) continue;
    if (arm_of_geom_[a] == arm_of_geom_[b] && near_at_home_.contains(BodiesOf(a, b))) continue;
    return Touch{a, b, data_->contact[i].dist};
  }
  return std::nullopt;
}

std::string ContactProbe::InWords(const Touch& touch) const {
  const auto name = [&](int geom) {
    const char* own = mj_id2name(model_.get(), mjOBJ_GEOM, geom);
    return std::string(own ? own : mj_id2name(model_.get(), mjOBJ_BODY, model_->geom_bodyid[geom]));
  };
  return fmt::format("{} is {:.3g} mm {} {}, expected a distance of {:.3g} mm", name(touch.geom),
                     1000 * std::abs(touch.distance), touch.distance < 0 ? "inside" : "from",
                     name(touch.other), 1000 * clearance_);
}

}  // namespace evalbus::policy
