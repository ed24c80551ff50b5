// Extended metrics about contact and limits: how near, how deep, how long. Ours (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "metrics/sample.h"

namespace evalbus {

// Smallest robot-to-scene distance (m) and the simulated time (s) at which it was first seen.
class MinClearance {
 public:
  void Start() { *this = {}; }
  void Add(double clearance, double time) {
    if (has_value_ && clearance >= clearance_) return;
    has_value_ = true;
    clearance_ = clearance;
    time_ = time;
  }
  bool has_value() const { return has_value_; }
  double clearance() const { return clearance_; }
  double time() const { return time_; }

 private:
  bool has_value_ = false;
  double clearance_ = 0;
  double time_ = 0;
};

// Deepest penetration (m, >= 0) of any contact with a robot geom in it, manipulated objects included.
class PeakPenetration {
 public:
  void Start() { depth_ = 0; }
  void Add(std::span<const GeomContact> contacts, const GeomOwners& owners) {
    for (const GeomContact& contact : contacts) {
      if (-contact.distance > depth_ && (owners.IsRobot(contact.geom_a) || owners.IsRobot(contact.geom_b))) {
        depth_ = -contact.distance;
      }
    }
  }
  double depth() const { return depth_; }

 private:
  double depth_ = 0;
};

// Simulated time (s): dt for every sample in which a robot geom touches a scene geom.
class ContactTime {
 public:
  explicit ContactTime(double dt) : dt_(dt) {}
  void Start() { samples_ = 0; }
  void Add(std::span<const GeomContact> contacts, const GeomOwners& owners) {
    samples_ += std::any_of(contacts.begin(), contacts.end(), [&](const GeomContact& contact) {
      return contact.distance <= kContactDistance &&
             ((owners.IsRobot(contact.geom_a) && owners.IsScene(contact.geom_b)) ||
              (owners.IsScene(contact.geom_a) && owners.IsRobot(contact.geom_b)));
    });
  }
  double time() const { return samples_ * dt_; }

 private:
  double dt_;
  int64_t samples_ = 0;
};

// Smallest distance (rad) of any joint to its nearer limit, negative beyond it; infinity before the first
// sample and where no joint has limits. A joint with lower >= upper has none.
class JointLimitMargin {
 public:
  void Start() { margin_ = std::numeric_limits<double>::infinity(); }
  void Add(std::span<const double> position, std::span<const double> lower, std::span<const double> upper) {
    for (size_t k = 0; k < lower.size(); ++k) {
      if (lower[k] < upper[k]) margin_ = std::min({margin_, position[k] - lower[k], upper[k] - position[k]});
    }
  }
  double margin() const { return margin_; }

 private:
  double margin_ = std::numeric_limits<double>::infinity();
};

}  // namespace evalbus
