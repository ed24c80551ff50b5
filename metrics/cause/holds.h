// Finds from when to when each gripper held each object, and how the hold ended. Used for the decisive moment.
#pragma once

#include <algorithm>
#include <cstdint>
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
// ends if there is no contact for kInterruption, or if the gripper opens by kOpened; an opened gripper must
// close by kClosed, or lose contact, before the next hold of the same object.
class Holds {
 public:
  static constexpr double kClosed = 0.05, kOpened = 0.1;  // fractions of the gripper's travel
  static constexpr double kInterruption = 0.3;            // s
  // An opening may rise by this fraction without being opened: the fingers yield.
  static constexpr double kYield = 0.01;

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

  void Add(const CauseSample& sample) {
    for (size_t k = 0; k < widest_.size(); ++k) widest_[k] = std::max(widest_[k], sample.opening[k]);
    for (size_t pair = 0; pair < pair_.size(); ++pair) {
      pair_[pair].hold < 0 ? Idle(pair, sample) : Held(pair, sample);
    }
  }

  // In order of their first tick.
  const std::vector<CauseHold>& holds() const { return holds_; }

 private:
  struct Pair {
    int hold = -1;  // index of the current hold; -1: none
    // Of the current hold: the smallest opening, the last tick at it, and the opening at the last contact.
    double lowest = 0;
    int64_t lowest_tick = 0;
    double last_opening = 0;
    // After an opened hold: the largest opening since.
    bool opened = false;
    double widest = 0;
  };

  void Idle(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    const size_t gripper = index % widest_.size(), object = index / widest_.size();
    const double opening = sample.opening[gripper];
    pair.widest = std::max(pair.widest, opening);
    if (!sample.touching[index]) pair.opened = false;
    if (opening > (pair.opened ? pair.widest : widest_[gripper]) - kClosed) return;
    if (!sample.touching[index]) return;
    pair = {.hold = static_cast<int>(holds_.size()), .lowest = opening, .lowest_tick = sample.tick};
    CauseHold hold{.object = static_cast<int>(object),
                   .gripper = static_cast<int>(gripper),
                   .first_tick = sample.tick,
                   .last_tick = sample.tick};
    hold.first_height = sample.object[object][2];
    holds_.push_back(hold);
    Held(index, sample);
  }

  void Held(size_t index, const CauseSample& sample) {
    Pair& pair = pair_[index];
    CauseHold& hold = holds_[pair.hold];
    const double opening = sample.opening[hold.gripper];
    if (sample.touching[index]) {
      hold.last_tick = sample.tick;
      hold.pinched_ticks += sample.pinched[index];
      hold.last_height = sample.object[hold.object][2];
      pair.last_opening = opening;
    }
    if (opening <= pair.lowest + kYield) pair.lowest_tick = sample.tick;
    pair.lowest = std::min(pair.lowest, opening);
    if (opening >= pair.lowest + kOpened) {
      hold.opened = true;
      hold.last_tick = std::min(hold.last_tick, pair.lowest_tick);
      End(&pair, &hold);
      pair.opened = true;
      pair.widest = opening;
    } else if (TickTime(sample.tick - hold.last_tick, dt_) >= kInterruption) {
      hold.closing = opening <= pair.last_opening - kClosed;
      End(&pair, &hold);
    }
  }

  static void End(Pair* pair, CauseHold* hold) {
    hold->is_over = true;
    pair->hold = -1;
  }

  double dt_;
  std::vector<double> widest_;  // by gripper: its largest opening
  std::vector<Pair> pair_;      // [object * grippers + gripper]
  std::vector<CauseHold> holds_;
};

}  // namespace evalbus::metrics
