// New collisions with the scene. Source: RoboEval's metrics page (env_collision_count).
#pragma once

#include "evalbus/metric_values_t.hpp"
#include "metrics/roboeval/new_members.h"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Evaluates samples 0, W, 2W, ...; in RoboEval's definition, W is 1. Counts the scene geoms that any robot
// geom touches in an evaluated sample but did not touch in the previous evaluated sample. In the first
// sample, all touched geoms count. Manipulated objects do not belong to the scene.
class EnvCollisions {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_collisions;
  explicit EnvCollisions(const MetricsConfig& config) : window_(config.collision_sample_window) {}

  void Start(const ResetState&) {
    samples_ = 0;
    touched_.Start();
  }

  void Add(const DerivedSample& derived) {
    if (samples_++ % window_ != 0) return;
    for (const SceneContact& contact : derived.contacts.scene()) touched_.Insert(contact.scene_geom);
    touched_.Commit();
  }

  void Values(metric_values_t* values) const { values->env_collision_count = touched_.count(); }
  // Number of new collisions by scene geom.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return touched_.counts(); }

 private:
  int64_t window_;
  int64_t samples_ = 0;
  NewMembers touched_;
};

}  // namespace evalbus::metrics
