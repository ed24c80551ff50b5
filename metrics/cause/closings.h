// Finds when a gripper closed completely with nothing between its fingers. Used for the decisive moment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "metrics/cause/cause_sample.h"
#include "metrics/cause/holds.h"

namespace evalbus::metrics {

struct EmptyClosing {
  int gripper;
  int64_t tick;                  // first tick at which the gripper was closed completely
  std::vector<double> distance;  // m, distance of the wrist from each object
  std::vector<uint8_t> touches;  // whether a pad touches each object from outside
};

// A gripper closes on nothing if its opening falls from at least kOpen to at most Holds::kShut and pads of
// both fingers never touch an object meanwhile. After such a touch, the gripper must reopen by kReopened (at
// least to kOpen), or to kWide, before a closing counts. Otherwise, an object that slips out would look like
// an empty closing.
class Closings {
 public:
  static constexpr double kOpen = 0.25, kReopened = 0.05, kWide = 0.9;  // fractions of the gripper's travel

  explicit Closings(const CauseConfig& config)
      : arm_(config.gripper_arm),
        was_open_(arm_.size()),
        pinched_at_(arm_.size()),
        nearest_(config.objects.size() * arm_.size()) {
    closings_.reserve(64);
  }

  void Start() {
    closings_.clear();
    was_open_.assign(was_open_.size(), 0);
    pinched_at_.assign(pinched_at_.size(), 0);
    nearest_.assign(nearest_.size(), INFINITY);
  }

  void Add(const CauseSample& sample) {
    const size_t grippers = arm_.size(), objects = nearest_.size() / std::max<size_t>(1, grippers);
    for (size_t k = 0; k < grippers; ++k) {
      bool pinched = false;
      for (size_t o = 0; o < objects; ++o) {
        pinched |= sample.pinched[o * grippers + k] != 0;
        double& nearest = nearest_[o * grippers + k];
        nearest = std::min(nearest, Distance(sample, o, k));
      }
      if (pinched) {
        was_open_[k] = 0;
        pinched_at_[k] = sample.opening[k];
      }
      if (sample.opening[k] >= std::clamp(pinched_at_[k] + kReopened, kOpen, kWide)) was_open_[k] = 1;
      if (sample.opening[k] > Holds::kShut || !was_open_[k]) continue;
      was_open_[k] = 0;
      EmptyClosing& closing = closings_.emplace_back();
      closing.gripper = static_cast<int>(k);
      closing.tick = sample.tick;
      for (size_t o = 0; o < objects; ++o) {
        closing.distance.push_back(Distance(sample, o, k));
        closing.touches.push_back(sample.touching[o * grippers + k]);
      }
    }
  }

  // Returns all empty closings so far, in chronological order.
  const std::vector<EmptyClosing>& closings() const { return closings_; }
  // Returns the smallest distance (m) in the episode between the gripper's wrist and the object.
  double Nearest(size_t object, size_t gripper) const { return nearest_[object * arm_.size() + gripper]; }

 private:
  double Distance(const CauseSample& sample, size_t object, size_t gripper) const {
    const auto &a = sample.object[object], &b = sample.wrist[arm_[gripper]];
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }

  std::vector<int> arm_;  // by gripper
  std::vector<uint8_t>
      was_open_;  // by gripper: it has been open, and its next closing is empty unless it pinches an object
  std::vector<double> pinched_at_;  // each gripper's opening at the last touch by both fingers
  std::vector<double> nearest_;
  std::vector<EmptyClosing> closings_;
};

}  // namespace evalbus::metrics
