// Divides the contacts of a sample into robot-scene and robot-robot contacts, once for all metrics.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "evalbus/contact_t.hpp"
#include "metrics/sample/sample.h"

namespace evalbus::metrics {

// A robot geom and a scene geom that touch.
struct SceneContact {
  int robot_geom;
  int scene_geom;
};

// Two robot geoms that touch, a <= b.
struct SelfContact {
  int a;
  int b;
};

class RobotContacts {
 public:
  RobotContacts() {
    scene_.reserve(64);
    self_.reserve(64);
  }

  void Sort(std::span<const GeomContact> contacts, const GeomOwners& owners) {
    scene_.clear();
    self_.clear();
    penetration_ = 0;
    for (const GeomContact& contact : contacts) {
      const int a = contact.geom_a, b = contact.geom_b;
      const bool robot_a = owners.IsRobot(a), robot_b = owners.IsRobot(b);
      if (!(contact.distance <= contact_t::TOUCH_DISTANCE_M) || (!robot_a && !robot_b)) continue;
      penetration_ = std::max(penetration_, -contact.distance);
      if (robot_a && robot_b) {
        self_.push_back({std::min(a, b), std::max(a, b)});
      } else if (robot_a && owners.IsScene(b)) {
        scene_.push_back({a, b});
      } else if (robot_b && owners.IsScene(a)) {
        scene_.push_back({b, a});
      }
    }
  }

  // Contacts in the order of the sample; a pair may occur more than once.
  std::span<const SceneContact> scene() const { return scene_; }
  std::span<const SelfContact> self() const { return self_; }
  // Returns the deepest penetration (m, >= 0) of any contact that involves a robot geom, including contacts
  // with manipulated objects.
  double penetration() const { return penetration_; }

 private:
  std::vector<SceneContact> scene_;
  std::vector<SelfContact> self_;
  double penetration_ = 0;
};

}  // namespace evalbus::metrics
