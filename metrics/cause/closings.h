// Finds when a gripper closed completely with nothing between its fingers, and when it came to an object and
// left it without closing. Used for the decisive moment.
#pragma once

#include <algorithm>
#include <array>
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

// The place at which a gripper came nearest to an object in the episode so far.
struct Approach {
  double distance = INFINITY;  // m, between wrist and object
  // Last tick at which the distance was larger by at most Closings::kThere.
  int64_t tick = 0;
  // Smallest distance (m) at which the gripper was closed: commanded to close by at least half, or, without
  // commands, closed completely.
  double closed_distance = INFINITY;
  // No other object was nearer to the wrist.
  bool is_nearest_object = false;
  double first_distance = INFINITY;  // m, in the reset state
  // Afterwards, the wrist moved away by more than Closings::kNear while the object moved by less than
  // kStayed.
  bool left = false;
  std::array<double, 3> object{};  // m, position of the object when the gripper was nearest
};

// A gripper closes on nothing if its opening falls from at least kOpen to at most Holds::kShut and pads of
// both fingers never touch an object meanwhile. After such a touch, the gripper must reopen by kReopened (at
// least to kOpen), or to kWide, before a closing counts. Otherwise, an object that slips out would look like
// an empty closing.
class Closings {
 public:
  static constexpr double kOpen = 0.25, kReopened = 0.05, kWide = 0.9;  // fractions of the gripper's travel
  // A gripper is at an object while its distance exceeds the smallest one in the episode by at most this
  // much.
  static constexpr double kNear = 0.1;     // m
  static constexpr double kThere = 0.002;  // m
  static constexpr double kStayed = 0.02;  // m

  explicit Closings(const CauseConfig& config)
      : arm_(config.gripper_arm),
        was_open_(arm_.size()),
        pinched_at_(arm_.size()),
        approaches_(config.objects.size() * arm_.size()) {
    closings_.reserve(64);
  }

  void Start() {
    closings_.clear();
    was_open_.assign(was_open_.size(), 0);
    pinched_at_.assign(pinched_at_.size(), 0);
    approaches_.assign(approaches_.size(), {});
  }

  void Add(const CauseSample& sample) {
    const size_t grippers = arm_.size(), objects = approaches_.size() / std::max<size_t>(1, grippers);
    Follow(sample);
    for (size_t k = 0; k < grippers; ++k) {
      bool pinched = false;
      for (size_t o = 0; o < objects; ++o) {
        pinched |= sample.pinched[o * grippers + k] != 0;
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
  const Approach& approach(size_t object, size_t gripper) const {
    return approaches_[object * arm_.size() + gripper];
  }

 private:
  void Follow(const CauseSample& sample) {
    const size_t grippers = arm_.size();
    for (size_t index = 0; index < approaches_.size(); ++index) {
      const size_t object = index / grippers, gripper = index % grippers;
      Approach& approach = approaches_[index];
      const double distance = Distance(sample, object, gripper);
      const bool is_closed =
          sample.closing.empty() ? sample.opening[gripper] <= Holds::kShut : sample.closing[gripper] >= 0.5;
      if (is_closed) approach.closed_distance = std::min(approach.closed_distance, distance);
      if (distance < approach.distance) {
        bool is_nearest_object = true;
        for (size_t other = 0; other < sample.object.size(); ++other)
          is_nearest_object &= Distance(sample, other, gripper) >= distance;
        if (std::isinf(approach.first_distance)) approach.first_distance = distance;
        approach.distance = distance;
        approach.is_nearest_object = is_nearest_object;
        approach.object = sample.object[object];
      }
      if (distance <= approach.distance + kThere) {
        approach.tick = sample.tick;
        approach.left = false;
      }
      approach.left |= distance > approach.distance + kNear &&
                       DistanceOfPoints(sample.object[object], approach.object) < kStayed;
    }
  }

  double Distance(const CauseSample& sample, size_t object, size_t gripper) const {
    return DistanceOfPoints(sample.object[object], sample.wrist[arm_[gripper]]);
  }

  std::vector<int> arm_;  // by gripper
  std::vector<uint8_t>
      was_open_;  // by gripper: it has been open, and its next closing is empty unless it pinches an object
  std::vector<double> pinched_at_;    // each gripper's opening at the last touch by both fingers
  std::vector<Approach> approaches_;  // [object * grippers + gripper]
  std::vector<EmptyClosing> closings_;
};

}  // namespace evalbus::metrics
