// Finds the intervals in which each gripper held each object, and how each hold ended. Used for the decisive
// moment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/cause/cause_sample.h"

namespace evalbus::metrics {

struct CauseHold {
  int object;
  int gripper;
  int64_t first_tick;
  // Last tick with contact; if the gripper was opened, the last tick before it began to open.
  int64_t last_tick;
  // The robot was at rest from this tick until the last contact.
  int64_t rest_since = 0;
  // Number of ticks at which pads of both fingers touched the object.
  int64_t pinched_ticks = 0;
  // At the last contact, the gripper was not closed completely, and no other object was between its fingers.
  bool is_wide = false;
  // The gripper was not closed completely at some contact.
  bool was_wide = false;
  bool is_over = false;
  // The hold ended because the gripper opened.
  bool opened = false;
  // The gripper lost the object less than Holds::kGrasping after the first contact, and continued to close.
  bool closing = false;
  // The gripper lost the object at most kPatience after it was commanded to open for a shorter time.
  bool flickered = false;
  // Height of the object (m) at first_tick, at the last contact, and the largest one until last_tick.
  double first_height = 0, contact_height = 0, peak_height = 0;
};

// A hold begins when a pad touches the object and the gripper has closed by kClosed from its largest opening
// and, if commands are known, is commanded to close by at least kClosed.
// It ends after kPatience without contact. It also ends if the gripper has been open by kOpened more than its
// minimum for kPatience and not both fingers touch the object. For this, the commanded opening, if known, is
// used instead of the measured one, because a strong gripper bounces on the object, and an object that slips
// out pushes the fingers apart. An opened gripper must close by kClosed before the next hold of the same
// object.
class Holds {
 public:
  static constexpr double kClosed = 0.05, kOpened = 0.1;  // fractions of the gripper's travel
  static constexpr double kPatience = 0.3;                // s
  // If commands are unknown, the opening in this time (s) after the first contact is ignored, because a
  // strong gripper that snaps shut overshoots.
  static constexpr double kSnap = 0.25;
  // A gripper that has held an object this long (s) no longer closes on it.
  static constexpr double kGrasping = 0.5;
  // A gripper begins to open when its opening exceeds its minimum by this fraction of its travel.
  static constexpr double kYield = 0.05;
  // A gripper that is open by at most this fraction is closed completely.
  static constexpr double kShut = 0.1;

  explicit Holds(const CauseConfig& config)
      : dt_(config.dt),
        widest_(config.grippers.size()),
        pair_(config.objects.size() * config.grippers.size()) {
    holds_.reserve(256);
  }

  void Start() {
    holds_.clear();
    widest_.assign(widest_.size(), 0);
    pair_.assign(pair_.size(), {});
  }

  // rest_since: tick since which the robot has been at rest.
  void Add(const CauseSample& sample, int64_t rest_since) {
    rest_since_ = rest_since;
    for (size_t k = 0; k < widest_.size(); ++k) widest_[k] = std::max(widest_[k], sample.opening[k]);
    for (size_t pair = 0; pair < pair_.size(); ++pair) {
      pair_[pair].hold < 0 ? Idle(pair, sample) : Held(pair, sample);
    }
  }

  // The holds are sorted by first tick.
  const std::vector<CauseHold>& holds() const { return holds_; }

 private:
  struct Pair {
    int hold = -1;  // index of the current hold; -1: none
    // Smallest opening during the current hold; last tick before the gripper began to open; last tick at
    // which it was not yet open.
    double narrowest = 0;
    int64_t before_opening = 0, last_closed = 0;
    double peak_before_opening = 0;  // m, largest height until before_opening
    int64_t last_open = -1;   // last tick, up to one after the contact, with a command to open; -1: none
    double last_opening = 0;  // opening at the last contact
    // True if the last hold ended by opening; and the largest opening since then.
    bool was_opened = false;
    double widest = 0;
  };

  bool IsPatienceOver(int64_t since, int64_t tick) const { return TickTime(tick - since, dt_) >= kPatience; }

  void Idle(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    const size_t gripper = index % widest_.size(), object = index / widest_.size();
    const double opening = sample.opening[gripper];
    pair.widest = std::max(pair.widest, opening);
    if (opening > (pair.was_opened ? pair.widest : widest_[gripper]) - kClosed) return;
    // A contact may push the fingers of an open gripper together.
    if (!sample.closing.empty() && sample.closing[gripper] < kClosed) return;
    if (!sample.touching[index]) return;
    pair = {.hold = static_cast<int>(holds_.size()),
            .narrowest = std::numeric_limits<double>::infinity(),
            .before_opening = sample.tick,
            .last_closed = sample.tick};
    CauseHold hold{.object = static_cast<int>(object),
                   .gripper = static_cast<int>(gripper),
                   .first_tick = sample.tick,
                   .last_tick = sample.tick};
    hold.first_height = hold.peak_height = sample.object[object][2];
    holds_.push_back(hold);
    Held(index, sample);
  }

  void Held(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    CauseHold& hold = holds_[pair.hold];
    const double opening = sample.opening[hold.gripper];
    if (sample.touching[index]) {
      hold.last_tick = sample.tick;
      hold.rest_since = rest_since_;
      hold.pinched_ticks += sample.pinched[index];
      hold.is_wide = opening > kShut && !PinchesAnother(sample, index);
      hold.was_wide |= opening > kShut;
      hold.contact_height = sample.object[hold.object][2];
      hold.peak_height = std::max(hold.peak_height, hold.contact_height);
      pair.last_opening = opening;
    }
    FollowOpening(sample, hold, &pair);
    const bool is_open = IsPatienceOver(pair.last_closed, sample.tick) && !sample.pinched[index];
    if (!is_open && !IsPatienceOver(hold.last_tick, sample.tick)) return;
    hold.is_over = true;
    // If the gripper opened only after the last contact, the object was lost, not released.
    hold.opened = pair.last_closed < sample.tick && pair.before_opening <= hold.last_tick;
    if (hold.opened) {
      hold.last_tick = pair.before_opening;
      hold.peak_height = pair.peak_before_opening;
    }
    hold.closing = !hold.opened && opening <= pair.last_opening - kClosed &&
                   TickTime(hold.last_tick - hold.first_tick, dt_) < kGrasping;
    hold.flickered = !hold.opened && pair.last_open >= 0 && !IsPatienceOver(pair.last_open, hold.last_tick);
    pair = {.was_opened = pair.last_closed < sample.tick, .widest = opening};
  }

  // Returns whether the gripper has another object between its fingers.
  bool PinchesAnother(const CauseSample& sample, size_t index) const {
    for (size_t pair = index % widest_.size(); pair < pair_.size(); pair += widest_.size()) {
      if (pair != index && sample.pinched[pair]) return true;
    }
    return false;
  }

  void FollowOpening(const CauseSample& sample, const CauseHold& hold, Pair* pair) const {
    const bool is_commanded = !sample.closing.empty();
    const double opening = is_commanded ? 1 - sample.closing[hold.gripper] : sample.opening[hold.gripper];
    if (is_commanded || sample.tick >= hold.first_tick + std::llround(kSnap / dt_)) {
      pair->narrowest = std::min(pair->narrowest, opening);
    }
    if (opening <= pair->narrowest + kYield) {
      pair->before_opening = sample.tick;
      pair->peak_before_opening = std::max(hold.peak_height, sample.object[hold.object][2]);
    }
    const bool is_open = opening >= pair->narrowest + kOpened;
    if (!is_open) pair->last_closed = sample.tick;
    // The object may leave the fingers in the tick in which they begin to open.
    if (is_open && is_commanded && sample.tick <= hold.last_tick + 1) pair->last_open = sample.tick;
  }

  double dt_;
  int64_t rest_since_ = 0;
  std::vector<double> widest_;  // each gripper's largest opening
  std::vector<Pair> pair_;      // [object * grippers + gripper]
  std::vector<CauseHold> holds_;
};

}  // namespace evalbus::metrics
