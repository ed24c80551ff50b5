// History of the manipulated objects in an episode, as needed by the failure reasons. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace evalbus::metrics {

class EpisodeHistory {
 public:
  // An object fell if it is this much lower (m) than when a gripper last held it.
  static constexpr double kFall = 0.02;
  // A gripper that holds nothing has closed on nothing if its opening decreased by this fraction of its
  // travel.
  static constexpr double kClosing = 0.1;

  EpisodeHistory(size_t objects, size_t grippers)
      : last_held_tick_(objects * grippers, -1), objects_(objects), widest_(grippers), missed_(grippers) {}

  void Start() {
    last_held_tick_.assign(last_held_tick_.size(), -1);
    objects_.assign(objects_.size(), {});
    widest_.assign(widest_.size(), 0);
    missed_.assign(missed_.size(), 0);
    touching_since_ = -1;
  }

  // Adds a tick, in tick order, the reset state included. `holding` is indexed [object * grippers + gripper];
  // `height` (m) is the height of each object's origin.
  void Add(int64_t tick, std::span<const double> opening, std::span<const uint8_t> holding,
           std::span<const double> height, bool touches_scene) {
    const size_t grippers = missed_.size();
    for (size_t k = 0; k < grippers; ++k) {
      widest_[k] = std::max(widest_[k], opening[k]);
      missed_[k] |= opening[k] <= widest_[k] - kClosing;
    }
    for (size_t o = 0; o < objects_.size(); ++o) {
      Object& object = objects_[o];
      object.height = height[o];
      object.is_held = false;
      for (size_t k = 0; k < grippers; ++k) {
        if (!holding[o * grippers + k]) continue;
        last_held_tick_[o * grippers + k] = tick;
        object.is_held = object.was_held = true;
        object.last_held_height = height[o];
        widest_[k] = opening[k];
        missed_[k] = 0;
      }
    }
    if (!touches_scene) {
      touching_since_ = -1;
    } else if (touching_since_ < 0) {
      touching_since_ = tick;
    }
  }

  // Last tick at which the gripper held the object; -1: never.
  int64_t LastHeldTick(size_t object, size_t gripper) const {
    return last_held_tick_[object * missed_.size() + gripper];
  }
  bool WasHeld(size_t object) const { return objects_[object].was_held; }
  bool IsHeld(size_t object) const { return objects_[object].is_held; }
  // Whether the object was held, is no longer held, and has fallen by at least kFall since.
  bool Fell(size_t object) const {
    const Object& o = objects_[object];
    return o.was_held && !o.is_held && o.last_held_height - o.height >= kFall;
  }
  // Whether the gripper has closed since it last held anything (or since the episode began) and holds
  // nothing.
  bool ClosedOnNothing(size_t gripper) const { return missed_[gripper]; }
  // First tick of the robot's current contact with the scene; -1 if there is none.
  int64_t touching_since() const { return touching_since_; }

 private:
  struct Object {
    bool was_held = false, is_held = false;
    double height = 0, last_held_height = 0;
  };
  std::vector<int64_t> last_held_tick_;
  std::vector<Object> objects_;
  std::vector<double> widest_;
  std::vector<uint8_t> missed_;
  int64_t touching_since_ = -1;
};

}  // namespace evalbus::metrics
