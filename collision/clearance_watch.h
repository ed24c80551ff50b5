// The robot's clearance over an episode: measured at every tick that has the smallest one so far, and often
// enough to be watched. Pure.
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
  // Simulated time after which it is measured in any case, for those who look on.
  static constexpr int64_t kShownEveryUs = 100'000;

  // tick_us: simulated time between ticks.
  ClearanceWatch(CollisionChecker* checker, int64_t tick_us)
      : checker_(checker), shown_every_((kShownEveryUs + tick_us / 2) / tick_us) {}

  // Begins an episode.
  void Start() { smallest_ = kInfinity; }

  // Of a tick whose poses the checker has, and its contacts. Not empty where it is smaller than at all ticks
  // before (but tick 0, which is no sample), where the robot touches the scene, and now and then.
  std::optional<Clearance> At(int64_t tick, std::span<const contact_t> contacts) {
    std::optional<Clearance> clearance;
    for (const contact_t& contact : contacts) {
      const std::optional<Clearance> touch = checker_->AsClearance(contact);
      if (touch && (!clearance || touch->distance < clearance->distance)) clearance = touch;
    }
    // Whatever else there is does not touch, so it is further away.
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
