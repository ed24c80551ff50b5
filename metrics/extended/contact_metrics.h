// Metrics of the robot's contacts with the scene, with objects and with itself, and of its distance to the
// scene. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"
#include "metrics/sample/quantile.h"
#include "metrics/sample/separation.h"

namespace evalbus::metrics {

// Number of times that a robot geom and a scene geom, or two robot geoms, begin to touch. A pair counts again
// only after it has been separated for kSeparationTime. A pair that touches in the first sample is counted.
class CollisionEvents : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"env_collision_events", "self_collision_events"};
  explicit CollisionEvents(const MetricsConfig& config) : dt_(config.control_dt) { pairs_.reserve(256); }

  void Start() override {
    pairs_.clear();
    environment_ = self_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    const int64_t tick = derived.sample.tick;
    for (const SceneContact& contact : derived.contacts.scene()) {
      environment_ += Begins(contact.robot_geom, contact.scene_geom, tick);
    }
    for (const SelfContact& contact : derived.contacts.self()) self_ += Begins(contact.a, contact.b, tick);
  }
  void Values(std::span<double> values) const override {
    values[0] = static_cast<double>(environment_);
    values[1] = static_cast<double>(self_);
  }

 private:
  struct Pair {
    int a, b;
    int64_t last_tick;
  };
  bool Begins(int a, int b, int64_t tick) {
    const auto pair =
        std::find_if(pairs_.begin(), pairs_.end(), [&](const Pair& p) { return p.a == a && p.b == b; });
    if (pair == pairs_.end()) {
      pairs_.push_back({a, b, tick});
      return true;
    }
    const int64_t last = std::exchange(pair->last_tick, tick);
    return Separated(last, tick, dt_);
  }

  double dt_;
  // Every pair that has touched in this episode, with the last tick at which it did.
  std::vector<Pair> pairs_;
  int64_t environment_ = 0;
  int64_t self_ = 0;
};

// Sum of dt (s) over all samples in which a robot geom touches a scene geom.
class ContactTime : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"contact_time_s"};
  explicit ContactTime(const MetricsConfig& config) : dt_(config.control_dt) {}

  void Start() override { samples_ = 0; }
  void Add(const DerivedSample& derived) override { samples_ += !derived.contacts.scene().empty(); }
  void Values(std::span<double> values) const override { values[0] = TickTime(samples_, dt_); }

 private:
  double dt_;
  int64_t samples_ = 0;
};

// Smallest clearance (m) among the samples at which it was evaluated, and the simulated time (s) at which it
// first occurred. There is no value before the first such sample.
class MinClearance : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"min_clearance_m", "min_clearance_time_s"};
  explicit MinClearance(const MetricsConfig&) {}

  void Start() override { clearance_ = time_ = kNone; }
  void Add(const DerivedSample& derived) override {
    const std::optional<double>& clearance = derived.sample.clearance;
    if (!clearance || clearance_ <= *clearance) return;
    clearance_ = *clearance;
    time_ = derived.sample.time;
  }
  void Values(std::span<double> values) const override {
    values[0] = clearance_;
    values[1] = time_;
  }

 private:
  double clearance_ = 0;
  double time_ = 0;
};

// Largest penetration (m, >= 0) of any contact that involves a robot geom, including contacts with
// manipulated objects.
class PeakPenetration : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_penetration_m"};
  explicit PeakPenetration(const MetricsConfig&) {}

  void Start() override { depth_ = 0; }
  void Add(const DerivedSample& derived) override {
    depth_ = std::max(depth_, derived.contacts.penetration());
  }
  void Values(std::span<double> values) const override { values[0] = depth_; }

 private:
  double depth_ = 0;
};

// Peak and 95th percentile of the force (N) with which the robot presses on the scene, on manipulated
// objects, or on itself. Only physics steps with such a force count, and each counts with the largest force
// of a pair of bodies. Without such steps, the peak is 0 and the percentile does not exist. The percentile is
// computed only at the end of the episode. There is no value if the source does not provide forces.
class ContactForces : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"p95_object_force_N",  "p95_scene_force_N",  "p95_self_force_N",
                                           "peak_object_force_N", "peak_scene_force_N", "peak_self_force_N"};
  explicit ContactForces(const MetricsConfig& /*config*/) {
    // Enough for 30 s of contact at 500 physics steps per second. More steps require a reallocation.
    for (std::vector<double>& forces : forces_) forces.reserve(15000);
  }

  void Start() override {
    for (std::vector<double>& forces : forces_) forces.clear();
    peak_.fill(kNone);
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    const ForceSample& forces = *derived.sample.forces;
    const std::array added = {forces.object, forces.scene, forces.self};
    for (size_t k = 0; k < added.size(); ++k) {
      forces_[k].insert(forces_[k].end(), added[k].begin(), added[k].end());
      // Replaces NaN, which means that forces are unknown, by 0: fmax() ignores a NaN operand.
      peak_[k] = std::fmax(peak_[k], 0);
      for (const double force : added[k]) peak_[k] = std::max(peak_[k], force);
    }
  }
  void Values(std::span<double> values) const override {
    std::fill(values.begin(), values.end(), kNone);
    std::copy(peak_.begin(), peak_.end(), values.begin() + static_cast<ptrdiff_t>(forces_.size()));
  }
  void FinalValues(int64_t /*last_tick*/, std::span<double> values) const override {
    Values(values);
    for (size_t k = 0; k < forces_.size(); ++k) {
      std::vector<double> sorted = forces_[k];
      std::sort(sorted.begin(), sorted.end());
      values[k] = Quantile(sorted, 0.95);
    }
  }

 private:
  // Forces of all steps, and peak force: on objects, on the scene, and on the robot itself.
  std::array<std::vector<double>, 3> forces_;
  std::array<double, 3> peak_{};
};

// Contacts of the robot with the scene and with itself. The first value is the largest kinetic energy with
// which such a contact begins (J). The second value is the integral of the contact force over time, summed
// over all such pairs of bodies (N s). The sim integrates at every physics step. There is no value if the
// source does not provide forces.
class UnwantedContact : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_touch_energy_J", "unwanted_impulse_Ns"};
  explicit UnwantedContact(const MetricsConfig& /*config*/) {}

  void Start() override {
    is_known_ = false;
    energy_ = impulse_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    is_known_ = true;
    energy_ = std::max(energy_, derived.sample.forces->unwanted_touch_energy);
    impulse_ += derived.sample.forces->unwanted_impulse;
  }
  void Values(std::span<double> values) const override {
    values[0] = is_known_ ? energy_ : kNone;
    values[1] = is_known_ ? impulse_ : kNone;
  }

 private:
  bool is_known_ = false;
  double energy_ = 0, impulse_ = 0;
};

}  // namespace evalbus::metrics
