// Finds contacts in which an arm pressed on something, or pushed an object that it did not hold. Used for the
// decisive moment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/cause/cause_sample.h"
#include "metrics/cause/holds.h"

namespace evalbus::metrics {

// A contact between an arm and an entity. Interruptions shorter than CauseCollisions::kInterruption do not
// end it.
struct ArmTouch {
  ArmContact pair;
  int64_t first_tick;
  int64_t last_tick;
  // Number of ticks at which the arm pressed.
  int64_t pressed_ticks = 0;
  // Largest distance (m) of the object from where it was at the first tick; 0 for the scene.
  double displacement = 0;
  // Last tick of the contact at which the object had moved by less than CauseCollisions::kMoved.
  int64_t push_tick = 0;
  // The arm was not at rest at the first tick; for an object, at some tick at which the object had moved by
  // less than CauseCollisions::kPushed.
  bool is_active = false;
  // Largest distance (m) of the arm's wrist from where it was at the first tick.
  double wrist_travel = 0;
  std::array<double, 3> start{}, wrist_start{};  // positions at the first tick
  // The arm's gripper was closed completely at the first tick.
  bool is_shut = false;
};

// The torques of a joint while its arm has touched nothing for at least kInterruption define the joint's free
// range, which always contains 0. Without gravity compensation, the free range includes the torques that
// carry the arm's weight. An arm presses while the torque of one of its joints exceeds the free range by at
// least kMinExcess and by at least the width of the range. Without a tick after the reset state at which the
// arm touched nothing, the range is unknown, and the joint does not press. Contacts of an arm with an object
// that its gripper holds are ignored.
class CauseCollisions {
 public:
  static constexpr double kMinExcess = 10;    // N m
  static constexpr double kInterruption = 1;  // s
  static constexpr double kMoved = 0.001;     // m
  static constexpr double kPushed = 0.02;     // m

  explicit CauseCollisions(const CauseConfig& config)
      : config_(config), free_torque_(config.joint_arm.size()) {
    touches_.reserve(256);
    last_contact_.resize(config.arms.size(), -1);
  }

  void Start() {
    touches_.clear();
    last_contact_.assign(last_contact_.size(), -1);
    free_torque_.assign(free_torque_.size(), {});
  }

  // held: [object * arms + arm]. resting: by arm.
  void Add(const CauseSample& sample, const std::vector<uint8_t>& held, const std::vector<uint8_t>& resting) {
    knows_torque_ = !sample.torque.empty();
    for (const ArmContact& contact : sample.contacts) {
      last_contact_[contact.arm] = sample.tick;
      const int object = ObjectOf(contact.entity);
      if (object >= 0 && held[object * config_.arms.size() + contact.arm]) continue;
      ArmTouch& touch = Current(contact, sample, object);
      touch.last_tick = sample.tick;
      touch.pressed_ticks += Presses(sample, contact.arm);
      const bool is_first = touch.first_tick == sample.tick;
      if (object >= 0 ? touch.displacement < kPushed : is_first) touch.is_active |= !resting[contact.arm];
      if (object >= 0) {
        touch.displacement =
            std::max(touch.displacement, DistanceOfPoints(sample.object[object], touch.start));
        touch.wrist_travel =
            std::max(touch.wrist_travel, DistanceOfPoints(sample.wrist[contact.arm], touch.wrist_start));
        if (touch.displacement < kMoved) touch.push_tick = sample.tick;
      }
    }
    for (size_t joint = 0; joint < sample.torque.size(); ++joint) {
      const int64_t last_contact = last_contact_[config_.joint_arm[joint]];
      if (last_contact >= 0 && !IsInterrupted(last_contact, sample.tick)) continue;
      Range& range = free_torque_[joint];
      range = {std::min(range.low, sample.torque[joint]), std::max(range.high, sample.torque[joint]),
               range.is_known || sample.tick > 0};
    }
  }

  // The touches are sorted by first tick.
  const std::vector<ArmTouch>& touches() const { return touches_; }
  bool knows_torque() const { return knows_torque_; }
  // Returns the index of the object with this entity; -1 if the entity is not an object.
  int ObjectOf(int entity) const {
    const auto found = std::ranges::find(config_.object_entity, entity);
    return found == config_.object_entity.end() ? -1
                                                : static_cast<int>(found - config_.object_entity.begin());
  }

 private:
  struct Range {
    double low = 0, high = 0;  // N m
    bool is_known = false;
  };

  bool IsInterrupted(int64_t last_tick, int64_t tick) const {
    return TickTime(tick - last_tick, config_.dt) >= kInterruption;
  }

  bool Presses(const CauseSample& sample, int arm) const {
    for (size_t joint = 0; joint < sample.torque.size(); ++joint) {
      if (config_.joint_arm[joint] != arm) continue;
      const Range& range = free_torque_[joint];
      if (!range.is_known) continue;
      const double excess = std::max(sample.torque[joint] - range.high, range.low - sample.torque[joint]);
      if (excess >= std::max(kMinExcess, range.high - range.low)) return true;
    }
    return false;
  }

  ArmTouch& Current(const ArmContact& pair, const CauseSample& sample, int object) {
    for (auto touch = touches_.rbegin(); touch != touches_.rend(); ++touch) {
      if (!(touch->pair == pair)) continue;
      if (!IsInterrupted(touch->last_tick, sample.tick)) return *touch;
      break;
    }
    ArmTouch touch{
        .pair = pair, .first_tick = sample.tick, .last_tick = sample.tick, .push_tick = sample.tick};
    for (size_t k = 0; k < config_.gripper_arm.size(); ++k) {
      if (config_.gripper_arm[k] == pair.arm) touch.is_shut = sample.opening[k] <= Holds::kShut;
    }
    if (object >= 0) {
      touch.start = sample.object[object];
      touch.wrist_start = sample.wrist[pair.arm];
    }
    return touches_.emplace_back(touch);
  }

  const CauseConfig& config_;
  bool knows_torque_ = false;
  std::vector<Range> free_torque_;     // by joint, without contact
  std::vector<int64_t> last_contact_;  // tick of each arm's last contact; -1: none
  std::vector<ArmTouch> touches_;
};

}  // namespace evalbus::metrics
