// Finds when a gripper closed completely with nothing between its fingers, and when it came to an object and
// left it without closing. Used for the decisive moment.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/cause/cause_sample.h"
#include "metrics/cause/holds.h"

namespace evalbus::metrics {

struct EmptyClosing {
  int gripper;
  int64_t tick;                  // first tick at which the gripper was closed completely
  std::vector<double> distance;  // m, distance of the wrist from each object
  std::vector<uint8_t> touches;  // whether a pad touches each object from outside
};

// The place at which a gripper came nearest to an object so far, since the object first came to rest. Before,
// the object falls to where the episode begins.
struct Approach {
  double distance = INFINITY;  // m, between wrist and object
  // Last tick at which the distance was larger by at most Closings::kThere.
  int64_t tick = 0;
  // Smallest distance (m) at which the gripper was closed: commanded to close by at least half, or, without
  // commands, closed completely.
  double closed_distance = INFINITY;
  // No other object was nearer to the wrist.
  bool is_nearest_object = false;
  double farthest = 0;      // m, largest distance before the gripper was nearest
  double farthest_now = 0;  // m, largest distance so far
  // The gripper has been open and within Closings::kNear of its smallest distance since this tick; and the
  // largest distance since then (m).
  int64_t stay_tick = 0;
  double stay_farthest = 0;
  // First tick of this stay at which the distance was larger by at most Closings::kArrived, and the distance
  // then (m).
  int64_t arrival_tick = 0;
  double arrival_distance = INFINITY;
  // Afterwards, the wrist moved away by more than Closings::kNear while the object moved by less than
  // kStayed.
  bool left = false;
  std::array<double, 3> object{};  // m, position of the object when the gripper was nearest
};

// A gripper closes on nothing if its opening falls from at least kOpen to at most Holds::kShut and pads of
// both fingers never touch an object meanwhile. After such a touch, the gripper must reopen by kReopened (at
// least to kOpen), or to kWide, before a closing counts. Otherwise, an object that slips out would look like
// an empty closing. A closing before the wrist has been kStayed from where it was at the first tick is not an
// attempt.
class Closings {
 public:
  static constexpr double kOpen = 0.25, kReopened = 0.05, kWide = 0.9;  // fractions of the gripper's travel
  // A gripper is at an object while its distance exceeds the smallest one in the episode by at most this
  // much.
  static constexpr double kNear = 0.1;      // m
  static constexpr double kThere = 0.002;   // m
  static constexpr double kStayed = 0.02;   // m
  static constexpr double kArrived = 0.01;  // m
  // An object has come to rest when it has moved by less than kMoved (m) for kRest (s).
  static constexpr double kMoved = 0.001, kRest = 0.1;

  explicit Closings(const CauseConfig& config)
      : dt_(config.dt),
        arm_(config.gripper_arm),
        settling_(config.objects.size()),
        was_open_(arm_.size()),
        pinched_at_(arm_.size()),
        has_left_(arm_.size()),
        approaches_(config.objects.size() * arm_.size()) {
    closings_.reserve(64);
    start_.reserve(arm_.size());
  }

  void Start() {
    closings_.clear();
    was_open_.assign(was_open_.size(), 0);
    pinched_at_.assign(pinched_at_.size(), 0);
    approaches_.assign(approaches_.size(), {});
    settling_.assign(settling_.size(), {});
    start_.clear();
    has_left_.assign(has_left_.size(), 0);
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
      if (start_.size() <= k) start_.push_back(sample.wrist[arm_[k]]);
      has_left_[k] |= DistanceOfPoints(sample.wrist[arm_[k]], start_[k]) >= kStayed;
      if (sample.opening[k] > Holds::kShut || !was_open_[k]) continue;
      was_open_[k] = 0;
      if (!has_left_[k]) continue;
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
  struct Settling {
    std::array<double, 3> from{INFINITY, INFINITY, INFINITY};
    int64_t since = 0;
    bool is_over = false;
  };

  // Returns whether the object has come to rest in this episode.
  bool HasSettled(const CauseSample& sample, size_t object) {
    Settling& settling = settling_[object];
    if (settling.is_over) return true;
    if (!(DistanceOfPoints(sample.object[object], settling.from) < kMoved)) {
      settling.from = sample.object[object];
      settling.since = sample.tick;
    }
    settling.is_over = TickTime(sample.tick - settling.since, dt_) >= kRest;
    return settling.is_over;
  }

  void Follow(const CauseSample& sample) {
    const size_t grippers = arm_.size();
    for (size_t object = 0; object < settling_.size(); ++object) {
      if (!HasSettled(sample, object)) continue;
      for (size_t gripper = 0; gripper < grippers; ++gripper)
        Follow(sample, object, gripper, &approaches_[object * grippers + gripper]);
    }
  }

  void Follow(const CauseSample& sample, size_t object, size_t gripper, Approach* approach) const {
    const double distance = Distance(sample, object, gripper);
    const bool is_closed =
        sample.closing.empty() ? sample.opening[gripper] <= Holds::kShut : sample.closing[gripper] >= 0.5;
    if (is_closed) approach->closed_distance = std::min(approach->closed_distance, distance);
    if (distance < approach->distance) {
      approach->is_nearest_object = true;
      for (size_t other = 0; other < sample.object.size(); ++other)
        approach->is_nearest_object &= Distance(sample, other, gripper) >= distance;
      approach->distance = distance;
      approach->farthest = approach->farthest_now;
      approach->object = sample.object[object];
    }
    approach->farthest_now = std::max(approach->farthest_now, distance);
    if (distance <= approach->distance + kThere) {
      approach->tick = sample.tick;
      approach->left = false;
    }
    approach->left |= distance > approach->distance + kNear &&
                      DistanceOfPoints(sample.object[object], approach->object) < kStayed;
    approach->stay_farthest = std::max(approach->stay_farthest, distance);
    if (is_closed || approach->stay_farthest > approach->distance + kNear) {
      approach->stay_tick = sample.tick;
      approach->stay_farthest = 0;
      approach->arrival_distance = INFINITY;
    }
    if (distance <= approach->arrival_distance - kArrived) {
      approach->arrival_tick = sample.tick;
      approach->arrival_distance = distance;
    }
  }

  double Distance(const CauseSample& sample, size_t object, size_t gripper) const {
    return DistanceOfPoints(sample.object[object], sample.wrist[arm_[gripper]]);
  }

  double dt_;
  std::vector<int> arm_;            // by gripper
  std::vector<Settling> settling_;  // by object
  std::vector<uint8_t>
      was_open_;  // by gripper: it has been open, and its next closing is empty unless it pinches an object
  std::vector<std::array<double, 3>> start_;  // m, of each gripper's wrist at the first tick
  std::vector<double> pinched_at_;            // each gripper's opening at the last touch by both fingers
  std::vector<uint8_t> has_left_;             // by gripper: its wrist has been kStayed from where it started
  std::vector<Approach> approaches_;          // [object * grippers + gripper]
  std::vector<EmptyClosing> closings_;
};

}  // namespace evalbus::metrics
