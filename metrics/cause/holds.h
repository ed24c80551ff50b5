// Finds from when to when each gripper held each object, and how the hold ended. Used for the decisive
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
  // Last tick with contact; if the gripper was opened, the tick at which it began to open.
  int64_t last_tick;
  // Tick since which the robot had been at rest at the last contact.
  int64_t rest_since = 0;
  // Number of ticks at which pads of both fingers touched the object.
  int64_t pinched_ticks = 0;
  bool is_over = false;
  // The hold ended because the gripper opened.
  bool opened = false;
  // The gripper continued to close while it lost the object.
  bool closing = false;
  // Height of the object (m) at the first and at the last tick.
  double first_height = 0, last_height = 0;
};

// A hold begins when a pad of a gripper that has closed by kClosed since it was widest touches the object. It
// ends if there is no contact for kInterruption, or if the gripper opens by kOpened within kOpening and not
// both fingers touch the object: a strong gripper bounces on it. It does not end by an opening in its first
// kSnap, and a gripper that closes again by kOpened within kInterruption was not opened: it lost the object.
// An opened gripper must close by kClosed before the next hold of the same object.
class Holds {
 public:
  static constexpr double kClosed = 0.05, kOpened = 0.1;        // fractions of the gripper's travel
  static constexpr double kInterruption = 0.3, kOpening = 0.5;  // s
  // A strong gripper that snaps shut overshoots and bounces for this time, s; it does not count as opening
  // then.
  static constexpr double kSnap = 0.25;
  // A gripper begins to open when its opening exceeds its minimum by this fraction.
  static constexpr double kYield = 0.05;

  explicit Holds(const CauseConfig& config)
      : dt_(config.dt),
        widest_(config.grippers.size()),
        recent_(config.grippers.size() * Recent(config.dt)),
        pair_(config.objects.size() * config.grippers.size()) {
    holds_.reserve(256);
  }

  void Start() {
    holds_.clear();
    widest_.assign(widest_.size(), 0);
    samples_ = 0;
    pair_.assign(pair_.size(), {});
  }

  // rest_since: tick since which the robot has been at rest.
  void Add(const CauseSample& sample, int64_t rest_since) {
    rest_since_ = rest_since;
    const size_t slot = samples_++ % Recent(dt_);
    for (size_t k = 0; k < widest_.size(); ++k) {
      widest_[k] = std::max(widest_[k], sample.opening[k]);
      recent_[k * Recent(dt_) + slot] = {sample.tick, sample.opening[k]};
    }
    for (size_t pair = 0; pair < pair_.size(); ++pair) {
      pair_[pair].hold < 0 ? Idle(pair, sample) : Held(pair, sample);
    }
  }

  // In order of their first tick.
  const std::vector<CauseHold>& holds() const { return holds_; }

 private:
  struct Opening {
    int64_t tick;
    double opening;
  };
  struct Pair {
    int hold = -1;            // index of the current hold; -1: none
    double last_opening = 0;  // at the last contact of the current hold
    // After an opened hold: its index (-1: none), its end, and the largest opening since.
    int opened_hold = -1;
    int64_t opened_tick = 0;
    double widest = 0;
  };

  // Number of samples within kOpening.
  static size_t Recent(double dt) { return static_cast<size_t>(std::ceil(kOpening / dt)) + 1; }

  // The first tick of a hold at which the gripper no longer snaps shut.
  int64_t Settled(const CauseHold& hold) const { return hold.first_tick + std::llround(kSnap / dt_); }

  // The smallest recent opening of the gripper since it settled.
  double Lowest(const CauseHold& hold) const {
    const size_t size = Recent(dt_);
    const int64_t settled = Settled(hold);
    double lowest = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < std::min(samples_, size); ++k) {
      const Opening& one = recent_[static_cast<size_t>(hold.gripper) * size + k];
      if (one.tick >= settled) lowest = std::min(lowest, one.opening);
    }
    return lowest;
  }

  // Last recent tick at which the gripper's opening was at most this.
  int64_t LastAtMost(double opening, const CauseHold& hold) const {
    const size_t size = Recent(dt_);
    int64_t last = hold.first_tick;
    for (size_t k = 0; k < std::min(samples_, size); ++k) {
      const Opening& one = recent_[static_cast<size_t>(hold.gripper) * size + k];
      if (one.opening <= opening) last = std::max(last, one.tick);
    }
    return last;
  }

  void Idle(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    const size_t gripper = index % widest_.size(), object = index / widest_.size();
    const double opening = sample.opening[gripper];
    pair.widest = std::max(pair.widest, opening);
    CheckOpening(pair, opening, sample.tick);
    if (opening > (pair.opened_hold >= 0 ? pair.widest : widest_[gripper]) - kClosed) return;
    if (!sample.touching[index]) return;
    pair.hold = static_cast<int>(holds_.size());
    pair.last_opening = 0;
    CauseHold hold{.object = static_cast<int>(object),
                   .gripper = static_cast<int>(gripper),
                   .first_tick = sample.tick,
                   .last_tick = sample.tick};
    hold.first_height = sample.object[object][2];
    holds_.push_back(hold);
    Held(index, sample);
  }

  // An object that slips out of the fingers pushes them apart, and then they close. They may touch it again
  // meanwhile, so that the next hold has begun.
  void CheckOpening(const Pair& pair, double opening, int64_t tick) {
    if (pair.opened_hold >= 0 && TickTime(tick - pair.opened_tick, dt_) <= kInterruption &&
        opening <= pair.widest - kOpened) {
      holds_[pair.opened_hold].opened = false;
    }
  }

  void Held(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    CauseHold& hold = holds_[pair.hold];
    const double opening = sample.opening[hold.gripper];
    CheckOpening(pair, opening, sample.tick);
    if (sample.touching[index]) {
      hold.last_tick = sample.tick;
      hold.rest_since = rest_since_;
      hold.pinched_ticks += sample.pinched[index];
      hold.last_height = sample.object[hold.object][2];
      pair.last_opening = opening;
    }
    const double lowest = Lowest(hold);
    if (opening >= lowest + kOpened && !sample.pinched[index]) {
      hold.opened = true;
      hold.last_tick = std::min(hold.last_tick, LastAtMost(lowest + kYield, hold));
      pair.opened_hold = pair.hold;
      pair.opened_tick = sample.tick;
      End(&pair, &hold);
      pair.widest = opening;
    } else if (TickTime(sample.tick - hold.last_tick, dt_) >= kInterruption) {
      hold.closing = opening <= pair.last_opening - kClosed;
      End(&pair, &hold);
      pair.opened_hold = -1;
    }
  }

  static void End(Pair* pair, CauseHold* hold) {
    hold->is_over = true;
    pair->hold = -1;
  }

  double dt_;
  int64_t rest_since_ = 0;
  std::vector<double> widest_;   // by gripper: its largest opening
  std::vector<Opening> recent_;  // by gripper: ring of its last Recent() openings
  size_t samples_ = 0;
  std::vector<Pair> pair_;  // [object * grippers + gripper]
  std::vector<CauseHold> holds_;
};

}  // namespace evalbus::metrics
