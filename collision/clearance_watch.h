// Measures the robot's clearance over an episode: at every tick with a new minimum or with a contact of robot
// and scene, and at regular intervals for display. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "collision/checker.h"

namespace evalbus::collision {

class ClearanceWatch {
 public:
  // Simulated time after which the clearance is measured even without a new minimum, for observers.
  static constexpr int64_t kShownEveryUs = 100'000;

  // tick_us: simulated time between ticks.
  ClearanceWatch(CollisionChecker* checker, int64_t tick_us)
      : checker_(checker), shown_every_((kShownEveryUs + tick_us / 2) / tick_us) {}

  // Begins an episode.
  void Start() { smallest_ = kInfinity; }

  // Returns the clearance at a tick. The poses of the tick must have been set in the checker. contacts: the
  // contacts of the tick. The result is not empty if the clearance is smaller than at all earlier ticks
  // (except tick 0, which is not a sample), if the robot touches the scene, and at regular intervals.
  std::optional<Clearance> At(int64_t tick, std::span<const contact_t> contacts) {
    std::optional<Clearance> clearance;
    for (const contact_t& contact : contacts) {
      const std::optional<Clearance> touch = checker_->AsClearance(contact);
      if (touch && (!clearance || touch->distance < clearance->distance)) clearance = touch;
    }
    // Other pairs are searched only if nothing touches, because they are farther apart than touching pairs.
    if (!clearance) {
      const bool is_shown = shown_every_ <= 1 || tick % shown_every_ == 0;
      clearance = checker_->FindClearance(is_shown ? kInfinity : smallest_);
    }
    if (clearance && tick > 0) smallest_ = std::min(smallest_, clearance->distance);
    return clearance;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CollisionChecker* checker_;
  int64_t shown_every_;
  double smallest_ = kInfinity;
};

}  // namespace evalbus::collision
