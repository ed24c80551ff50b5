#include "sim/contact_points.h"

#include <algorithm>
#include <utility>

#include "evalbus/contact_force_t.hpp"

namespace evalbus::sim {

ContactPoints::ContactPoints(const mjModel& model, const model_info_t& info)
    : geoms_(static_cast<size_t>(model.ngeom)) {
  const auto size = static_cast<size_t>(model.nv);
  jacobian_a_.resize(3 * size);
  jacobian_b_.resize(3 * size);
  normal_.resize(size);
  solved_.resize(size);
  for (size_t k = 0; k < geoms_.size(); ++k) {
    const int entity = info.body_entity[static_cast<size_t>(model.geom_bodyid[k])];
    const auto object = std::ranges::find(info.object_entity, entity);
    geoms_[k].is_robot = info.entity_kind[static_cast<size_t>(entity)] == model_info_t::ROBOT;
    geoms_[k].is_object = object != info.object_entity.end();
    if (geoms_[k].is_object) geoms_[k].object = static_cast<int>(object - info.object_entity.begin());
  }
  for (const int geom : info.forbidden_contact_geom) geoms_[static_cast<size_t>(geom)].is_forbidden = true;
  int first = 0;
  for (size_t gripper = 0; gripper < info.gripper.size(); ++gripper) {
    std::vector<int> bodies;
    for (const int geom : info.gripper[gripper].pad_geom) {
      const int body = model.geom_bodyid[geom];
      if (std::ranges::find(bodies, body) == bodies.end()) bodies.push_back(body);
      Geom& pad = geoms_[static_cast<size_t>(geom)];
      pad.gripper = static_cast<int>(gripper);
      pad.finger = first + static_cast<int>(std::ranges::find(bodies, body) - bodies.begin());
    }
    fingers_.push_back(static_cast<int>(bodies.size()));
    first += fingers_.back();
  }
}

int8_t ContactPoints::Kind(int geom_a, int geom_b) const {
  const Geom &a = geoms_[static_cast<size_t>(geom_a)], &b = geoms_[static_cast<size_t>(geom_b)];
  if (a.is_robot && b.is_robot) {
    const bool is_one_gripper = a.gripper >= 0 && a.gripper == b.gripper;
    return is_one_gripper ? int8_t{-1} : contact_force_t::SELF;
  }
  if (a.is_robot || b.is_robot) {
    const Geom& other = a.is_robot ? b : a;
    return other.is_object && !other.is_forbidden ? contact_force_t::OBJECT : contact_force_t::SCENE;
  }
  return a.is_object || b.is_object ? contact_force_t::OTHER : int8_t{-1};
}

void ContactPoints::BeforeStep(const mjModel& model, mjData* data, const ForceSums& touched) {
  points_.clear();
  contacts_.clear();
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    const int8_t kind = Kind(contact.geom1, contact.geom2);
    // Contacts without rows in the constraint solver transmit no force.
    if (kind < 0 || contact.efc_address < 0) continue;
    ContactPoint point{};
    point.kind = kind;
    point.body_a = model.geom_bodyid[contact.geom1];
    point.body_b = model.geom_bodyid[contact.geom2];
    if (point.body_a > point.body_b) std::swap(point.body_a, point.body_b);
    const Geom &a = geoms_[static_cast<size_t>(contact.geom1)],
               &b = geoms_[static_cast<size_t>(contact.geom2)];
    point.finger = std::max(a.finger, b.finger);
    point.object = std::max(a.object, b.object);
    if (!touched.Touched(kind, point.body_a, point.body_b)) {
      point.touch_energy = TouchEnergy(model, data, contact);
    }
    points_.push_back(point);
    contacts_.push_back(i);
  }
}

double ContactPoints::TouchEnergy(const mjModel& model, mjData* data, const mjContact& contact) {
  mj_jac(&model, data, jacobian_a_.data(), nullptr, contact.pos, model.geom_bodyid[contact.geom1]);
  mj_jac(&model, data, jacobian_b_.data(), nullptr, contact.pos, model.geom_bodyid[contact.geom2]);
  // The normal points from geom1 to geom2.
  mju_subFrom(jacobian_b_.data(), jacobian_a_.data(), 3 * model.nv);
  mju_mulMatTVec(normal_.data(), jacobian_b_.data(), contact.frame, 3, model.nv);
  const double speed = mju_dot(normal_.data(), data->qvel, model.nv);
  if (speed >= 0) return 0;
  mj_solveM(&model, data, solved_.data(), normal_.data(), 1);
  const double inverse_mass = mju_dot(normal_.data(), solved_.data(), model.nv);
  return inverse_mass > 0 ? speed * speed / inverse_mass / 2 : 0;
}

std::span<const ContactPoint> ContactPoints::AfterStep(const mjModel& model, const mjData& data) {
  for (size_t k = 0; k < points_.size(); ++k) {
    const mjContact& contact = data.contact[contacts_[k]];
    mjtNum force[6], world[3];
    mj_contactForce(&model, &data, contacts_[k], force);
    // contact.frame has the axes of the contact frame as its rows. The force acts on geom2.
    mju_mulMatTVec(world, contact.frame, force, 3, 3);
    const double sign = model.geom_bodyid[contact.geom1] == points_[k].body_a ? 1 : -1;
    points_[k].normal_force = force[0];
    points_[k].force = {sign * world[0], sign * world[1], sign * world[2]};
  }
  return points_;
}

}  // namespace evalbus::sim
