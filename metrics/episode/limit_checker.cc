#include "metrics/episode/limit_checker.h"

#include <algorithm>

#include "evalbus/contact_force_t.hpp"
#include "lcmtypes/clock.h"
#include "metrics/sample/separation.h"

namespace evalbus::metrics {

LimitChecker::LimitChecker(const ModelNames& names)
    : model_(names.model()), dt_(ControlPeriod(names.model())) {
  if (model_.limits_yaml.empty()) return;
  for (const int entity : model_.body_entity) {
    is_robot_.push_back(model_.entity_kind[entity] == model_info_t::ROBOT);
  }
  for (ForceLimit& limit : ParseForceLimits(model_.limits_yaml, model_.limits_file)) {
    Region region{.limit = std::move(limit), .has_body = std::vector<uint8_t>(model_.num_bodies)};
    for (size_t k = 0; k < region.limit.bodies.size(); ++k) {
      const std::vector<uint8_t> bodies = names.Bodies(region.limit.bodies[k], region.limit.locations[k]);
      for (size_t body = 0; body < bodies.size(); ++body) region.has_body[body] |= bodies[body];
    }
    regions_.push_back(std::move(region));
  }
}

void LimitChecker::Start() {
  touches_.clear();
  violations_.clear();
}

void LimitChecker::Add(const state_t& state) {
  const auto is_body = [this](int body) { return body >= 0 && body < model_.num_bodies; };
  for (const contact_force_t& force : state.contact_force) {
    if (!is_body(force.body_a) || !is_body(force.body_b)) continue;
    for (size_t region = 0; region < regions_.size(); ++region) {
      for (const auto& [body, other] :
           {std::pair(force.body_a, force.body_b), std::pair(force.body_b, force.body_a)}) {
        if (!regions_[region].has_body[body] || !is_robot_[other]) continue;
        AddTouch(region, body, other, force.peak_force_N, state.header.tick);
      }
    }
  }
}

LimitChecker::Touch& LimitChecker::Find(size_t region, int body, int robot_body, int64_t tick) {
  const auto touch = std::ranges::find_if(touches_, [&](const Touch& known) {
    return known.region == region && known.body == body && known.robot_body == robot_body;
  });
  if (touch == touches_.end()) return touches_.emplace_back(region, body, robot_body, tick, tick);
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
  // A contact that exceeds the quasi-static limit after the transient one violates both.
  const bool continues = touch.violation >= 0 && violations_[touch.violation].is_transient == is_transient &&
                         !Separated(touch.last_violation_tick, tick, dt_);
  touch.last_violation_tick = tick;
  if (continues) {
    double& peak = violations_[touch.violation].force_N;
    peak = std::max(peak, force);
    return;
  }
  touch.violation = static_cast<int>(violations_.size());
  limit_violation_t& violation = violations_.emplace_back();
  violation.region = limit.region;
  violation.body = model_.body_name[body];
  violation.robot_body = model_.body_name[robot_body];
  violation.is_transient = is_transient;
  violation.limit_N = largest;
  violation.force_N = force;
  violation.tick = tick;
  violation.time_s = TickTime(tick, dt_);
}

}  // namespace evalbus::metrics
