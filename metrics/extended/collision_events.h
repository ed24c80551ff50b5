// Collision events. A flickering contact counts once. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "metrics/extended/extended_metric.h"
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

}  // namespace evalbus::metrics
