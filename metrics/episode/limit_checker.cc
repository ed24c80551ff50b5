#include "metrics/episode/limit_checker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "evalbus/contact_force_t.hpp"
#include "lcmtypes/clock.h"
#include "metrics/sample/separation.h"

namespace evalbus::metrics {
namespace {

limit_violation_t Violation(const ForceLimit& region, const std::string& body, const std::string& robot_body,
                            const char* limit, double limit_force, double force, int64_t tick) {
  limit_violation_t violation{};
  violation.region = region.region;
  violation.body = body;
  violation.robot_body = robot_body;
  violation.limit = limit;
  violation.limit_N = limit_force;
  violation.force_N = force;
  violation.tick = tick;
  return violation;
}

}  // namespace

LimitChecker::LimitChecker(const ModelNames& names)
    : model_(names.model()), dt_(ControlPeriod(names.model())) {
  if (model_.limits_yaml.empty()) return;
  for (const int entity : model_.body_entity) {
    is_robot_.push_back(model_.entity_kind[entity] == model_info_t::ROBOT);
  }
  for (ForceLimit& limit : ParseForceLimits(model_.limits_yaml, model_.limits_file)) {
    std::vector<uint8_t> bodies = BodiesOf(limit, names);
    regions_.push_back({.limit = std::move(limit), .has_body = std::move(bodies)});
  }
  for (const gripper_info_t& gripper : model_.gripper) {
    std::vector<int>& bodies = finger_bodies_.emplace_back();
    for (const int geom : gripper.pad_geom) bodies.push_back(model_.geom_body[geom]);
    std::ranges::sort(bodies);
    bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  }
  Start();
}

bool LimitChecker::has_grip_limits() const {
  return std::ranges::any_of(regions_,
                             [](const Region& region) { return std::isfinite(region.limit.grip_force); });
}

void LimitChecker::Start() {
  touches_.clear();
  violations_.clear();
  grips_.assign(regions_.size() * finger_bodies_.size(), {});
  largest_squeeze_ = 0;
  squeeze_ticks_ = 0;
}

void LimitChecker::Add(const state_t& state) {
  const auto is_body = [this](int body) { return body >= 0 && body < model_.num_bodies; };
  for (const contact_force_t& force : state.contact_force) {
    if (!is_body(force.body_a) || !is_body(force.body_b)) continue;
    // A pair that touched only in the last step of the previous tick is listed with force 0.
    if (force.peak_force_N == 0) continue;
    for (size_t region = 0; region < regions_.size(); ++region) {
      for (const auto& [body, other] :
           {std::pair(force.body_a, force.body_b), std::pair(force.body_b, force.body_a)}) {
        if (!regions_[region].has_body[body] || !is_robot_[other]) continue;
        AddTouch(region, body, other, force.peak_force_N, state.header.tick);
      }
    }
  }
  AddGrips(state);
}

int LimitChecker::GrippedObject(size_t gripper, const state_t& state) const {
  int gripped = -1;
  double largest = 0;
  for (int object = 0; object < model_.num_objects; ++object) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const int finger : finger_bodies_[gripper]) {
      double sum = 0;
      for (const contact_force_t& force : state.contact_force) {
        const int other = force.body_a == finger ? force.body_b : force.body_b == finger ? force.body_a : -1;
        if (other >= 0 && other < model_.num_bodies &&
            model_.body_entity[other] == model_.object_entity[object])
          sum += force.mean_force_N;
      }
      smallest = std::min(smallest, sum);
    }
    if (!(smallest > largest) || finger_bodies_[gripper].empty()) continue;
    largest = smallest;
    gripped = object;
  }
  return gripped;
}

void LimitChecker::AddGrips(const state_t& state) {
  if (!has_grip_limits()) return;
  bool is_squeezed = false;
  for (size_t gripper = 0; gripper < finger_bodies_.size(); ++gripper) {
    const double force = state.gripper[gripper].grip_force_peak_N;
    const int object = force > 0 ? GrippedObject(gripper, state) : -1;
    if (object < 0) continue;
    for (size_t k = 0; k < regions_.size(); ++k) {
      const Region& region = regions_[k];
      int body = 0;
      while (body < model_.num_bodies &&
             !(region.has_body[body] && model_.body_entity[body] == model_.object_entity[object]))
        ++body;
      if (body == model_.num_bodies || !(force > region.limit.grip_force)) continue;
      is_squeezed = true;
      largest_squeeze_ = std::max(largest_squeeze_, force - region.limit.grip_force);
      Report(Violation(region.limit, model_.body_name[body], model_.gripper[gripper].name, "grip",
                       region.limit.grip_force, force, state.header.tick),
             &grips_[k * finger_bodies_.size() + gripper]);
    }
  }
  squeeze_ticks_ += is_squeezed;
}

void LimitChecker::Report(limit_violation_t violation, Latest* latest) {
  const bool continues = latest->violation >= 0 && violations_[latest->violation].limit == violation.limit &&
                         !Separated(latest->last_tick, violation.tick, dt_);
  latest->last_tick = violation.tick;
  if (continues) {
    double& peak = violations_[latest->violation].force_N;
    peak = std::max(peak, violation.force_N);
    return;
  }
  latest->violation = static_cast<int>(violations_.size());
  violation.time_s = TickTime(violation.tick, dt_);
  violations_.push_back(std::move(violation));
}

LimitChecker::Touch& LimitChecker::Find(size_t region, int body, int robot_body, int64_t tick) {
  const auto touch = std::ranges::find_if(touches_, [&](const Touch& known) {
    return known.region == region && known.body == body && known.robot_body == robot_body;
  });
  if (touch == touches_.end()) {
    touches_.push_back({region, body, robot_body, tick, tick});
    return touches_.back();
  }
  if (Separated(touch->last_tick, tick, dt_)) touch->first_tick = tick;
  touch->last_tick = tick;
  return *touch;
}

void LimitChecker::AddTouch(size_t region, int body, int robot_body, double force, int64_t tick) {
  Touch& touch = Find(region, body, robot_body, tick);
  const ForceLimit& limit = regions_[region].limit;
  const bool is_transient = TickTime(tick - touch.first_tick + 1, dt_) <= limit.transient_time;
  const double largest = is_transient ? limit.transient_force : limit.quasi_static_force;
  if (!(force > largest)) return;
  // If a contact first exceeds the transient limit and later the quasi-static limit, it violates both.
  Report(Violation(limit, model_.body_name[body], model_.body_name[robot_body],
                   is_transient ? "transient" : "quasi_static", largest, force, tick),
         &touch.latest);
}

}  // namespace evalbus::metrics
