// New collisions with the scene. Source: RoboEval's metrics page (env_collision_count).
#pragma once

#include <span>

#include "metrics/roboeval/new_members.h"
#include "metrics/robot_contacts.h"

namespace evalbus::metrics {

// Looks at samples 0, W, 2W, ...; W = 1, every sample, is the definition. Counts the scene geoms touched by
// any robot geom now and not at the previous look; what is touched at the first look is new. Manipulated
// objects are no scene.
class EnvCollisions {
 public:
  explicit EnvCollisions(int window) : window_(window) {}

  void Start() {
    samples_ = 0;
    touched_.Start();
  }

  void Add(std::span<const SceneContact> contacts) {
    if (samples_++ % window_ != 0) return;
    for (const SceneContact& contact : contacts) touched_.Insert(contact.scene_geom);
    touched_.Commit();
  }

  int64_t count() const { return touched_.count(); }
  // By scene geom.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return touched_.counts(); }

 private:
  int64_t window_;
  int64_t samples_ = 0;
  NewMembers touched_;
};

}  // namespace evalbus::metrics
