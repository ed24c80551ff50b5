// New collisions of the robot with itself. Source: RoboEval's metrics page (self_collision_count).
#pragma once

#include "evalbus/metric_values_t.hpp"
#include "metrics/roboeval/new_members.h"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Evaluates samples 0, W, 2W, ...; in RoboEval's definition, W is 1. Counts the unordered pairs of robot
// geoms that touch in an evaluated sample but did not touch in the previous evaluated sample. In the first
// sample, all touching pairs count.
class SelfCollisions {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_collisions;
  explicit SelfCollisions(const MetricsConfig& config) : window_(config.collision_sample_window) {}

  void Start(const ResetState&) {
    samples_ = 0;
    touching_.Start();
  }

  void Add(const DerivedSample& derived) {
    if (samples_++ % window_ != 0) return;
    for (const SelfContact& contact : derived.contacts.self())
      touching_.Insert(int64_t{contact.a} << 32 | contact.b);
    touching_.Commit();
  }

  void Values(metric_values_t* values) const { values->self_collision_count = touching_.count(); }
  // Number of new collisions by pair; the key holds the lower geom id in its upper half.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return touching_.counts(); }

 private:
  int64_t window_;
  int64_t samples_ = 0;
  NewMembers touching_;
};

}  // namespace evalbus::metrics
