// New collisions with the scene. Source: RoboEval's metrics page (env_collision_count).
#pragma once

#include "evalbus/metric_values_t.hpp"
#include "metrics/roboeval/new_members.h"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Looks at samples 0, W, 2W, ...; W = 1, every sample, is the definition. Counts the scene geoms touched by
// any robot geom now and not at the previous look; what is touched at the first look is new. Manipulated
// objects are no scene.
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
  // By scene geom.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return touched_.counts(); }

 private:
  int64_t window_;
  int64_t samples_ = 0;
  NewMembers touched_;
};

}  // namespace evalbus::metrics
