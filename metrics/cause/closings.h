// Finds when a gripper closed completely without touching an object. Used for the decisive moment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "metrics/cause/cause_sample.h"

namespace evalbus::metrics {

struct EmptyClosing {
  int gripper;
  int64_t tick;                  // at which the gripper was closed
  std::vector<double> distance;  // m, of the wrist from each object
};

// A gripper closes on nothing if its opening falls from at least kOpen to at most kShut while its pads touch
// no object. After a touch, it must first open by kReopened, or to kWide: it also closes when an object slips
// out.
class Closings {
 public:
  static constexpr double kOpen = 0.25, kShut = 0.1, kReopened = 0.05,
                          kWide = 0.9;  // fractions of the gripper's travel

  explicit Closings(const CauseConfig& config)
      : arm_(config.gripper_arm),
        was_open_(arm_.size()),
        touched_at_(arm_.size()),
        nearest_(config.objects.size() * arm_.size()) {
    closings_.reserve(64);
  }

  void Start() {
    closings_.clear();
    was_open_.assign(was_open_.size(), 0);
    touched_at_.assign(touched_at_.size(), 0);
    nearest_.assign(nearest_.size(), INFINITY);
  }

  void Add(const CauseSample& sample) {
    const size_t grippers = arm_.size(), objects = nearest_.size() / std::max<size_t>(1, grippers);
    for (size_t k = 0; k < grippers; ++k) {
      bool touching = false;
      for (size_t o = 0; o < objects; ++o) {
        touching |= sample.touching[o * grippers + k] != 0;
        double& nearest = nearest_[o * grippers + k];
        nearest = std::min(nearest, Distance(sample, o, k));
      }
      if (touching) {
        was_open_[k] = 0;
        touched_at_[k] = sample.opening[k];
      }
      if (sample.opening[k] >= std::clamp(touched_at_[k] + kReopened, kOpen, kWide)) was_open_[k] = 1;
      if (sample.opening[k] > kShut || !was_open_[k]) continue;
      was_open_[k] = 0;
      closings_.push_back({static_cast<int>(k), sample.tick, {}});
      for (size_t o = 0; o < objects; ++o) closings_.back().distance.push_back(Distance(sample, o, k));
    }
  }

  // In chronological order.
  const std::vector<EmptyClosing>& closings() const { return closings_; }
  // Smallest distance (m) in the episode of the gripper's wrist from the object.
  double Nearest(size_t object, size_t gripper) const { return nearest_[object * arm_.size() + gripper]; }

 private:
  double Distance(const CauseSample& sample, size_t object, size_t gripper) const {
    const auto &a = sample.object[object], &b = sample.wrist[arm_[gripper]];
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }

  std::vector<int> arm_;            // by gripper
  std::vector<uint8_t> was_open_;   // by gripper: open, without contact, since the last closing
  std::vector<double> touched_at_;  // by gripper: its opening at the last touch
  std::vector<double> nearest_;
  std::vector<EmptyClosing> closings_;
};

}  // namespace evalbus::metrics
