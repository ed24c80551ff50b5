#include "metrics/cause/cause_finder.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {
namespace {

// Contacts that are shorter than this (s) do not count as holds.
constexpr double kShortestHold = 0.1;
// A loss does not count if a later hold lasts more than this many times as long as the lost one.
constexpr int kLonger = 2;
// A stage that is reached this soon (s) after an event is still part of it.
constexpr double kSameTime = 0.2;
// An object fell if it is this much (m) lower than when it was last held.
constexpr double kFallen = 0.02;
// An object was lifted if it rose by this much (m) while it was held.
constexpr double kLifted = 0.01;
// A gripper whose wrist is farther from an object than this (m) did not come to grasp it.
constexpr double kReach = 0.4;
// A contact is a collision if the arm presses for kPressed (s), or if it pushes an object that it should hold
// by CauseCollisions::kPushed (m). If the torques are unknown, touching the scene or another arm for
// kTouched (s) is also a collision.
constexpr double kPressed = 0.5, kTouched = 1;
// A robot has stalled if it is at rest for the last kLastShare of the episode, and for at least kStill (s),
// and made progress at most kPatience (s) before it came to rest. Otherwise, if it made progress within the
// last kLastShare and was slow or not at rest for the last kStill, the time ran out. If an object slides out
// of a hand after the robot has been at rest for kStill, the cause is the stall.
constexpr double kLastShare = 0.2, kStill = 2, kPatience = 1.5;
// An open gripper that came to an object this long (s) before the robot stopped did not close.
constexpr double kWaited = 1;
// A robot is slow if no joint ever moves faster than this, rad/s.
constexpr double kSlow = 0.25;

bool IsOfHold(const condition_t& condition) { return condition.kind == condition_t::HOLDING; }

// Returns whether the condition requires that something is absent. This is decided by the words of its text.
bool IsNegated(const condition_t& condition) {
  return condition.text.find(" not ") != std::string::npos || condition.text.starts_with("no ");
}

int64_t LastShare(int64_t last_tick) {
  return static_cast<int64_t>(kLastShare * static_cast<double>(last_tick));
}

// Returns whether the gripper came to the object, and was not always near it.
bool IsApproach(const Approach& approach) {
  return approach.is_nearest_object && approach.distance <= kReach &&
         approach.distance <= approach.farthest - Closings::kNear;
}

int64_t Length(const CauseHold& hold) { return hold.last_tick - hold.first_tick; }

bool IsAnyGripper(const std::string& name) { return name == "any" || name == "first" || name == "other"; }

}  // namespace

CauseFinder::CauseFinder(CauseConfig config)
    : config_(std::move(config)),
      holds_(config_),
      closings_(config_),
      collisions_(config_),
      rest_(config_.dt),
      arm_rest_(config_.arms.size(), Rest(config_.dt)),
      held_(config_.objects.size() * config_.arms.size()),
      resting_(config_.arms.size()),
      height_(config_.objects.size()) {}

void CauseFinder::Start() {
  holds_.Start();
  closings_.Start();
  collisions_.Start();
  progress_.Start();
  rest_.Start();
  for (Rest& rest : arm_rest_) rest.Start();
  stage_tick_.clear();
  conditions_ = {};
}

int64_t CauseFinder::Ticks(double seconds) const { return std::llround(seconds / config_.dt); }

// Returns whether the last share of the episode, and at least kStill, has passed since the tick.
bool CauseFinder::IsSinceLong(int64_t tick, int64_t last_tick) const {
  return last_tick - tick >= std::max(LastShare(last_tick), Ticks(kStill));
}

double CauseFinder::Time(int64_t tick) const { return TickTime(tick, config_.dt); }

// Returns whether the operand is the object or a part of it.
bool CauseFinder::IsOf(const std::string& operand, size_t object) const {
  const std::string& name = config_.objects[object];
  return operand == name || operand.starts_with(name + "/");
}

bool CauseFinder::IsAbout(const condition_t& condition, size_t object) const {
  return IsOf(condition.subject, object) || IsOf(condition.other, object);
}

bool CauseFinder::IsAboutAny(const std::vector<Unmet>& unmet, size_t object) const {
  return std::ranges::any_of(unmet, [&](const Unmet& u) { return IsAbout(*u.condition, object); });
}

// Returns whether the condition involves this object and no other.
bool CauseFinder::IsAboutOnly(const condition_t& condition, size_t object) const {
  for (size_t other = 0; other < config_.objects.size(); ++other) {
    if (IsAbout(condition, other) != (other == object)) return false;
  }
  return true;
}

// Returns the points for a name: the wrists of the grippers with this name, or the first body with this name
// or entity.
std::vector<int> CauseFinder::PointsOf(const std::string& operand) const {
  const int num_bodies = static_cast<int>(config_.bodies.size());
  std::vector<int> points;
  for (size_t k = 0; k < config_.grippers.size(); ++k) {
    const std::string& name = config_.grippers[k];
    if (operand == name || operand == name + "_gripper" || IsAnyGripper(operand))
      points.push_back(num_bodies + config_.gripper_arm[k]);
  }
  for (int body = 0; points.empty() && body < num_bodies; ++body) {
    if (operand == config_.bodies[body] || operand == config_.entities[config_.body_entity[body]])
      points.push_back(body);
  }
  return points;
}

CauseFinder::Measure CauseFinder::MeasureOf(const condition_t& condition) const {
  Measure measure{.points = {}, .farthest = condition.other == "other"};
  const bool is_near = IsOfHold(condition) || condition.kind == condition_t::CONTACT;
  if (condition.has_value || IsNegated(condition) || !is_near) return measure;
  for (const int a : PointsOf(condition.subject)) {
    for (const int b : PointsOf(condition.other)) measure.points.emplace_back(a, b);
  }
  return measure;
}

double CauseFinder::Distance(const Measure& measure, const CauseSample& sample) const {
  const auto point = [&](int index) {
    const int arm = index - static_cast<int>(config_.bodies.size());
    return arm < 0 ? sample.body[index].position_m : sample.wrist[arm].data();
  };
  double distance = NAN;
  for (const auto& [first, second] : measure.points) {
    const double *a = point(first), *b = point(second);
    const double d = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    distance = measure.farthest ? std::fmax(distance, d) : std::fmin(distance, d);
  }
  return distance;
}

void CauseFinder::Add(const CauseSample& sample, std::span<const uint8_t> stage_reached,
                      std::span<const std::vector<condition_t>> conditions) {
  rest_.Add(sample.tick, sample.joints, sample.commands, sample.closing);
  for (size_t arm = 0, first = 0; arm < arm_rest_.size(); ++arm) {
    const auto n = static_cast<size_t>(std::ranges::count(config_.joint_arm, static_cast<int>(arm)));
    const auto part = [&](std::span<const double> all) {
      return first + n <= all.size() ? all.subspan(first, n) : std::span<const double>();
    };
    const std::span<const double> commands = part(sample.commands);
    // Another arm may move this one through an object, so only its commands count.
    arm_rest_[arm].Add(sample.tick, commands.empty() ? part(sample.joints) : commands, commands);
    first += n;
  }
  holds_.Add(sample, rest_.since());
  closings_.Add(sample);
  held_.assign(held_.size(), 0);
  for (const CauseHold& hold : holds_.holds()) {
    if (!hold.is_over && !IsPush(hold))
      held_[hold.object * config_.arms.size() + config_.gripper_arm[hold.gripper]] = 1;
  }
  for (size_t arm = 0; arm < arm_rest_.size(); ++arm)
    resting_[arm] = sample.tick - arm_rest_[arm].since() >= Ticks(Rest::kCommandLag);
  collisions_.Add(sample, held_, resting_);
  for (size_t o = 0; o < height_.size(); ++o) height_[o] = sample.object[o][2];
  stage_tick_.resize(stage_reached.size(), -1);
  for (size_t k = 0; k < stage_reached.size(); ++k) {
    if (stage_reached[k] && stage_tick_[k] < 0) stage_tick_[k] = sample.tick;
  }
  if (sample.tick == 0) return;
  conditions_ = conditions;
  size_t index = 0;
  for (const std::vector<condition_t>& section : conditions) {
    for (const condition_t& condition : section) {
      if (index == measures_.size()) measures_.push_back(MeasureOf(condition));
      progress_.Add(index, sample.tick, condition, Distance(measures_[index], sample));
      ++index;
    }
  }
}

std::vector<CauseFinder::Unmet> CauseFinder::FindUnmet() const {
  std::vector<Unmet> unmet;
  size_t index = 0;
  for (size_t k = 0; k < conditions_.size(); ++k) {
    for (const condition_t& condition : conditions_[k]) {
      const BestOfCondition& best = progress_.best(index++);
      const bool is_open = k >= stage_tick_.size() || stage_tick_[k] < 0;
      if (is_open && !condition.holds) unmet.push_back({&condition, &best});
    }
  }
  return unmet;
}

// Returns whether a stage about the object was reached after the tick.
bool CauseFinder::StageAbout(size_t object, int64_t after) const {
  for (size_t k = 0; k < stage_tick_.size() && k < conditions_.size(); ++k) {
    if (stage_tick_[k] <= after) continue;
    if (std::ranges::any_of(conditions_[k], [&](const auto& c) { return IsAbout(c, object); })) return true;
  }
  return false;
}

// Returns whether the gripper really held the object, and did not only touch it with closed fingers.
bool CauseFinder::IsGrasp(const CauseHold& hold) const {
  if (Length(hold) < Ticks(kShortestHold)) return false;
  // A finger that touches the object from outside, while the gripper opens or closes, does not hold it.
  return hold.pinched_ticks >= Ticks(kShortestHold) || (hold.is_wide && !hold.closing && !hold.opened);
}

// Returns whether a closed gripper touched an object that had been put down before.
bool CauseFinder::IsPush(const CauseHold& hold) const {
  return !hold.was_wide && std::ranges::any_of(holds_.holds(), [&](const CauseHold& other) {
    return other.object == hold.object && other.last_tick < hold.first_tick && other.opened;
  });
}

// Returns whether the gripper held the object after the tick. gripper: -1 for any.
bool CauseFinder::HeldAfter(int64_t tick, int object, int gripper) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return hold.object == object && (gripper < 0 || hold.gripper == gripper) && hold.last_tick > tick &&
           IsGrasp(hold);
  });
}

bool CauseFinder::IsHeldAt(int64_t tick, int object) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return hold.object == object && hold.first_tick <= tick && (!hold.is_over || hold.last_tick >= tick);
  });
}

bool CauseFinder::IsTouchedAtEnd(int object, int gripper) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return hold.object == object && hold.gripper == gripper && !hold.is_over;
  });
}

// Returns whether the object is now lower than at the last contact of this hold, by at least kFallen.
bool CauseFinder::HasFallen(const CauseHold& hold) const {
  return height_[hold.object] <= hold.contact_height - kFallen;
}

// Returns whether the task has a condition that the gripper holds the object. gripper: empty for any.
bool CauseFinder::AsksForHold(size_t object, const std::string& gripper) const {
  return std::ranges::any_of(conditions_, [&](const auto& section) {
    return std::ranges::any_of(section, [&](const condition_t& c) {
      return IsOfHold(c) && !IsNegated(c) && IsOf(c.subject, object) &&
             (gripper.empty() || c.other == gripper);
    });
  });
}

// Returns whether the task requires that the object is lifted or is above some height.
bool CauseFinder::AsksForLift(size_t object) const {
  return std::ranges::any_of(conditions_, [&](const auto& section) {
    return std::ranges::any_of(section, [&](const condition_t& c) {
      return (c.predicate == "lift" || c.predicate == "height_above") && !IsNegated(c) &&
             IsOf(c.subject, object);
    });
  });
}

// Returns whether success requires that no gripper, or a certain one, holds the object.
bool CauseFinder::AsksForRelease(size_t object) const {
  return std::ranges::any_of(conditions_.back(), [&](const condition_t& c) {
    return IsOfHold(c) && IsNegated(c) && IsOf(c.subject, object);
  });
}

// Returns whether the task requires that the object is released here: the object has not fallen and all
// success conditions that involve only this object are met, including one about its release.
bool CauseFinder::IsReleaseAsRequired(const CauseHold& hold) const {
  const auto object = static_cast<size_t>(hold.object);
  if (!hold.opened || HasFallen(hold)) return false;
  bool is_released = false, is_in_place = false;
  for (const condition_t& condition : conditions_.back()) {
    if (!IsAboutOnly(condition, object)) continue;
    if (!condition.holds) return false;
    (IsOfHold(condition) ? is_released : is_in_place) = true;
  }
  return is_released && is_in_place;
}

// Returns whether a gripper pulled the object without lifting it, before a hold that lifted it.
bool CauseFinder::IsPullBeforeLift(const CauseHold& pull) const {
  const auto lifts = [](const CauseHold& hold) { return hold.contact_height - hold.first_height >= kLifted; };
  return !lifts(pull) && std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return hold.object == pull.object && hold.first_tick > pull.last_tick && lifts(hold);
  });
}

// Returns whether another hold of the object makes up for the loss. It was already active at the loss, lasted
// until the end of the episode, or lasted much longer than the lost hold. If the task names this gripper,
// holds by other grippers do not count.
bool CauseFinder::IsMadeGood(const CauseHold& lost) const {
  const bool is_named = AsksForHold(static_cast<size_t>(lost.object), config_.grippers[lost.gripper]);
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    if (hold.object != lost.object || (is_named && hold.gripper != lost.gripper)) return false;
    if (hold.last_tick < lost.last_tick + Ticks(kShortestHold)) return false;
    if (hold.first_tick <= lost.last_tick || !hold.is_over) return true;
    // If the gripper opened and grasped again, it only changed its grip, so a later grasp of any length makes
    // up for the loss.
    return IsGrasp(hold) && Length(hold) > (lost.opened ? Ticks(kShortestHold) : kLonger * Length(lost));
  });
}

void CauseFinder::AddLosses(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const {
  for (const CauseHold& hold : holds_.holds()) {
    const auto object = static_cast<size_t>(hold.object);
    if (!hold.is_over || !IsGrasp(hold) || !IsAboutAny(unmet, object)) continue;
    // A hand that was always closed completely only pushed the object.
    if (!hold.was_wide) continue;
    if (!AsksForHold(object) && !(HasFallen(hold) && hold.pinched_ticks >= Ticks(kShortestHold))) continue;
    if (IsMadeGood(hold) || IsPullBeforeLift(hold) || IsReleaseAsRequired(hold)) continue;
    if (StageAbout(object, hold.last_tick + Ticks(kSameTime))) continue;
    if (!hold.opened && hold.last_tick - hold.rest_since >= Ticks(kStill)) {
      moments->push_back({.kind = cause_kind::kStall,
                          .tick = hold.rest_since,
                          .gripper = hold.gripper,
                          .object = hold.object,
                          .lost_tick = hold.last_tick});
      continue;
    }
    moments->push_back({.kind = cause_kind::kLostObject,
                        .tick = hold.last_tick,
                        .gripper = hold.gripper,
                        .object = hold.object,
                        .opened = hold.opened,
                        .closing = hold.closing,
                        .flickered = hold.flickered,
                        .put_down = hold.opened && !HasFallen(hold) && AsksForRelease(object),
                        .lifted = hold.peak_height - hold.first_height});
  }
}

// Returns whether a gripper that closed on nothing at this tick, at this distance (m) from the object, or
// that did not close there, should have grasped the object.
bool CauseFinder::IsMiss(int gripper, int64_t tick, double distance, const std::vector<Unmet>& unmet,
                         size_t object) const {
  const auto index = static_cast<int>(object);
  constexpr double kNear = Closings::kNear;
  if (distance > closings_.approach(object, gripper).distance + kNear) return false;
  // In a handover, the gripper that came nearer should have grasped the object first.
  bool is_of_another = false;
  for (size_t k = 0; k < config_.grippers.size() && AsksForHold(object, "other"); ++k)
    is_of_another |= closings_.approach(object, k).distance + kNear < distance;
  for (const Unmet& u : unmet) {
    if (!IsOfHold(*u.condition) || IsNegated(*u.condition) || !IsOf(u.condition->subject, object)) continue;
    const std::string& asked = u.condition->other;
    if (!IsAnyGripper(asked) && asked != config_.grippers[gripper]) continue;
    // "other" stands for a handover. If no gripper held the object when this gripper closed, the object had
    // been lost before the handover, so this gripper did not miss it.
    if (asked == "other" && !IsHeldAt(tick, index)) continue;
    const bool by_any = asked == "any" || asked == "first";
    if (by_any && is_of_another) continue;
    if (!HeldAfter(asked == "other" ? -1 : tick, index, by_any ? -1 : gripper)) return true;
  }
  // A single touch satisfies a condition that a gripper holds the object. The later conditions need a grasp.
  if (!IsAboutAny(unmet, object) || IsTouchedAtEnd(index, gripper)) return false;
  if (AsksForHold(object, config_.grippers[gripper])) return !HeldAfter(-1, index, gripper);
  return AsksForLift(object) && !is_of_another && !HeldAfter(-1, index, -1);
}

void CauseFinder::AddEmptyGrasps(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const {
  for (const EmptyClosing& closing : closings_.closings()) {
    for (size_t o = 0; o < config_.objects.size(); ++o) {
      if (!IsMiss(closing.gripper, closing.tick, closing.distance[o], unmet, o)) continue;
      moments->push_back({.kind = cause_kind::kEmptyGrasp,
                          .tick = closing.tick,
                          .gripper = closing.gripper,
                          .object = static_cast<int>(o),
                          .touches = closing.touches[o] != 0});
    }
  }
  for (size_t o = 0; o < config_.objects.size(); ++o) {
    for (size_t k = 0; k < config_.grippers.size(); ++k) {
      const Approach& approach = closings_.approach(o, k);
      if (!approach.left || !IsApproach(approach) ||
          approach.closed_distance <= approach.distance + Closings::kNear)
        continue;
      const auto gripper = static_cast<int>(k);
      if (!IsMiss(gripper, approach.tick, approach.distance, unmet, o)) continue;
      moments->push_back({.kind = cause_kind::kEmptyGrasp,
                          .tick = approach.tick,
                          .gripper = gripper,
                          .object = static_cast<int>(o),
                          .stayed_open = true});
    }
  }
}

// Returns the first gripper that should hold an object, came to it, and stayed there open until the end;
// nullopt if no gripper did.
std::optional<CauseMoment> CauseFinder::OpenHandAtObject(const std::vector<Unmet>& unmet,
                                                         int64_t last_tick) const {
  std::optional<CauseMoment> first;
  for (size_t o = 0; o < config_.objects.size(); ++o) {
    for (size_t k = 0; k < config_.grippers.size(); ++k) {
      const Approach& approach = closings_.approach(o, k);
      const auto gripper = static_cast<int>(k);
      if (!IsSinceLong(approach.stay_tick, last_tick) || !IsApproach(approach) ||
          (first && first->tick <= approach.arrival_tick) ||
          !IsMiss(gripper, approach.arrival_tick, approach.distance, unmet, o))
        continue;
      first = CauseMoment{.kind = cause_kind::kEmptyGrasp,
                          .tick = approach.arrival_tick,
                          .gripper = gripper,
                          .object = static_cast<int>(o),
                          .stayed_open = true};
    }
  }
  return first;
}

// Adds the falls of objects that a closed gripper pushed from where they were.
void CauseFinder::AddFalls(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const {
  for (const CauseHold& hold : holds_.holds()) {
    const auto object = static_cast<size_t>(hold.object);
    if (!hold.is_over || hold.was_wide || !HasFallen(hold) || !IsAboutAny(unmet, object)) continue;
    const bool is_last =
        std::ranges::none_of(holds_.holds(),
                             [&](const CauseHold& other) {
                               return other.object == hold.object && other.last_tick > hold.last_tick;
                             }) &&
        std::ranges::none_of(collisions_.touches(), [&](const ArmTouch& touch) {
          return touch.pair.entity == config_.object_entity[object] && touch.first_tick > hold.last_tick;
        });
    if (!is_last) continue;
    moments->push_back({.kind = cause_kind::kCollision,
                        .tick = hold.last_tick,
                        .object = hold.object,
                        .arm = config_.gripper_arm[hold.gripper],
                        .entity = config_.object_entity[object],
                        .fell = true});
  }
}

// Returns whether the hold is by a gripper of this arm, of the object of this contact, and ended at most
// kInterruption before the contact began.
bool CauseFinder::IsRecent(const CauseHold& hold, const ArmTouch& touch) const {
  return config_.object_entity[hold.object] == touch.pair.entity &&
         config_.gripper_arm[hold.gripper] == touch.pair.arm &&
         hold.last_tick >= touch.first_tick - Ticks(CauseCollisions::kInterruption);
}

// Returns whether a gripper of this arm held the object when this contact began, or shortly before.
bool CauseFinder::WasJustHeld(const ArmTouch& touch) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return IsRecent(hold, touch) && hold.first_tick <= touch.first_tick && !IsPush(hold);
  });
}

// Returns whether a gripper of this arm had put the object down shortly before the contact, and the object
// stayed there.
bool CauseFinder::WasReleased(const ArmTouch& touch) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    return IsRecent(hold, touch) && hold.last_tick <= touch.first_tick && hold.opened && !HasFallen(hold);
  });
}

// Returns whether the contact belongs to a grasp, because fingers touch the scene when they grasp an object
// or put it down: the arm's gripper holds an object that the task requires, and this hold did not end more
// than kInterruption before the contact.
bool CauseFinder::IsTouchOfGrasp(const ArmTouch& touch) const {
  return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
    const auto object = static_cast<size_t>(hold.object);
    return config_.gripper_arm[hold.gripper] == touch.pair.arm &&
           (!hold.is_over || hold.last_tick >= touch.first_tick - Ticks(CauseCollisions::kInterruption)) &&
           IsGrasp(hold) && (AsksForHold(object) || AsksForLift(object));
  });
}

// Returns whether the two arms of this contact held the same object, for example to hand it over.
bool CauseFinder::IsOfCommonGrasp(const ArmTouch& touch) const {
  const auto other = std::ranges::find(config_.arm_entity, touch.pair.entity) - config_.arm_entity.begin();
  const auto holds = [&](std::ptrdiff_t arm, int object) {
    return std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
      return config_.gripper_arm[hold.gripper] == arm && hold.object == object &&
             hold.first_tick <= touch.last_tick &&
             (!hold.is_over || hold.last_tick >= touch.first_tick - Ticks(CauseCollisions::kInterruption));
    });
  };
  for (size_t object = 0; object < config_.objects.size(); ++object) {
    if (holds(touch.pair.arm, static_cast<int>(object)) && holds(other, static_cast<int>(object)))
      return true;
  }
  return false;
}

void CauseFinder::AddCollisions(const std::vector<Unmet>& unmet, int64_t last_tick,
                                std::vector<CauseMoment>* moments) const {
  for (const ArmTouch& touch : collisions_.touches()) {
    const int object = collisions_.ObjectOf(touch.pair.entity);
    const bool is_with_arm =
        std::ranges::find(config_.arm_entity, touch.pair.entity) != config_.arm_entity.end();
    // Fingers may touch an object, and so reach a stage, while the arms press against each other.
    const bool is_jam = is_with_arm && touch.pressed_ticks >= Ticks(kPressed);
    const int64_t later = (is_jam ? touch.last_tick : touch.first_tick) + Ticks(kSameTime);
    const int64_t remaining = last_tick - touch.first_tick;
    const bool is_stuck = 2 * touch.pressed_ticks >= remaining && remaining >= Ticks(kStill);
    // An arm at rest may be in the way of an object that another arm pushes.
    constexpr double kPushed = CauseCollisions::kPushed;
    const bool pushes = object >= 0 && touch.is_active && touch.displacement >= kPushed &&
                        touch.wrist_travel >= kPushed / 2 && AsksForHold(static_cast<size_t>(object)) &&
                        !HeldAfter(touch.first_tick, object, -1) &&
                        IsAboutAny(unmet, static_cast<size_t>(object));
    const bool is_displaced = pushes && WasReleased(touch) && !StageAbout(static_cast<size_t>(object), later);
    if (!is_stuck && !is_displaced &&
        std::ranges::any_of(stage_tick_, [&](int64_t tick) { return tick > later; }))
      continue;
    const bool is_excused =
        WasJustHeld(touch) || (!is_stuck && IsTouchOfGrasp(touch) && (!is_jam || IsOfCommonGrasp(touch)));
    if (!is_displaced && is_excused) continue;
    // The arm that moved hit the other one.
    if (is_with_arm && !touch.is_active) continue;
    bool is_collision = touch.pressed_ticks >= Ticks(kPressed);
    if (object < 0 && !collisions_.knows_torque())
      is_collision |= touch.last_tick - touch.first_tick >= Ticks(kTouched);
    int64_t tick = touch.first_tick;
    if (!is_collision && pushes) {
      is_collision = true;
      // The arm may have touched the object before, without moving it.
      tick = touch.push_tick;
    }
    if (!is_collision || tick > last_tick) continue;
    moments->push_back({.kind = cause_kind::kCollision,
                        .tick = tick,
                        .object = object,
                        .arm = touch.pair.arm,
                        .entity = touch.pair.entity,
                        .displacement = touch.displacement,
                        .is_shut = touch.is_shut && object >= 0 && AsksForHold(static_cast<size_t>(object))});
  }
}

// Returns whether the task has a condition that this gripper holds an object, which it does not hold now.
bool CauseFinder::LacksHold(const std::string& gripper) const {
  return std::ranges::any_of(conditions_, [&](const auto& section) {
    return std::ranges::any_of(section, [&](const condition_t& c) {
      return IsOfHold(c) && !IsNegated(c) && c.other == gripper && !c.holds;
    });
  });
}

// Returns whether all that is missing depends on this gripper: that it touches something, or the state of
// something that the task requires it to touch. Arms may work one after the other, so an arm that rests may
// wait for another.
bool CauseFinder::LacksOnlyTouch(const std::string& gripper, const std::vector<Unmet>& unmet) const {
  const std::string name = gripper + "_gripper";
  const auto is_touch = [&](const condition_t& c) {
    return c.kind == condition_t::CONTACT && !IsNegated(c) && (c.subject == name || c.other == name);
  };
  const auto is_touched = [&](const std::string& subject) {
    return std::ranges::any_of(conditions_, [&](const auto& section) {
      return std::ranges::any_of(section, [&](const condition_t& c) {
        return is_touch(c) && (c.subject == name ? c.other : c.subject) == subject;
      });
    });
  };
  return !unmet.empty() && std::ranges::all_of(unmet, [&](const Unmet& u) {
    return is_touch(*u.condition) || is_touched(u.condition->subject);
  });
}

// Returns the first stop of an arm that should hold an object and stopped for good while another arm
// continued to move; nullopt if no arm did.
std::optional<CauseMoment> CauseFinder::IdleArm(const std::vector<Unmet>& unmet, int64_t last_tick) const {
  std::optional<CauseMoment> first;
  for (size_t k = 0; k < config_.grippers.size(); ++k) {
    const int arm = config_.gripper_arm[k];
    const int64_t since = arm_rest_[arm].since();
    if (!IsSinceLong(since, last_tick)) continue;
    const bool another_moves = std::ranges::any_of(
        arm_rest_, [&](const Rest& other) { return other.since() - since >= Ticks(kStill); });
    const std::string& gripper = config_.grippers[k];
    if (!another_moves || !(LacksHold(gripper) || LacksOnlyTouch(gripper, unmet)) ||
        (first && first->tick <= since))
      continue;
    first = CauseMoment{.kind = cause_kind::kStall, .tick = since, .arm = arm};
  }
  return first;
}

CauseMoment CauseFinder::MomentWithoutEvent(const std::vector<Unmet>& unmet, const CauseEnd& end) const {
  // All that is missing was reached before.
  if (!unmet.empty() &&
      std::ranges::all_of(unmet, [](const Unmet& u) { return u.condition->has_value && u.best->was_met; }))
    return {.kind = cause_kind::kMissedCondition, .tick = unmet[0].best->progress_tick, .is_undone = true};
  const auto idle = IdleArm(unmet, end.last_tick);
  const auto open = OpenHandAtObject(unmet, end.last_tick);
  int64_t progress = 0;
  for (const int64_t tick : stage_tick_) progress = std::max(progress, tick);
  if (!unmet.empty()) progress = std::max(progress, unmet[0].best->progress_tick);
  const int64_t rest = rest_.since();
  const int64_t last_share = LastShare(end.last_tick);
  if (IsSinceLong(rest, end.last_tick) && rest - progress <= Ticks(kPatience)) {
    // If an arm stopped before the others, and should only touch something, all else was done.
    bool lacks_hold = false;
    for (size_t k = 0; idle && k < config_.grippers.size(); ++k)
      lacks_hold |= config_.gripper_arm[k] == idle->arm && LacksHold(config_.grippers[k]);
    if (idle && !lacks_hold) return *idle;
    if (open && rest - open->tick >= Ticks(kWaited)) return *open;
    return {.kind = cause_kind::kStall, .tick = rest};
  }
  // A slow robot may have come too little closer for its approach to count as progress, and it may wait.
  const bool is_slow = rest_.largest_step() <= kSlow * config_.dt;
  const bool has_stopped = !is_slow && end.last_tick - rest >= Ticks(kStill);
  if ((progress == 0 && is_slow && end.last_tick - rest < last_share) ||
      (end.last_tick - progress <= last_share && !has_stopped)) {
    return {.kind = cause_kind::kOutOfTime, .tick = end.last_tick, .made_progress = progress > 0};
  }
  if (idle) return *idle;
  if (open) return *open;
  for (const Unmet& u : unmet) {
    if (u.condition->has_value) progress = std::max(progress, u.best->progress_tick);
  }
  return {.kind = cause_kind::kMissedCondition, .tick = progress};
}

CauseMoment CauseFinder::FindMoment(const std::vector<Unmet>& unmet, const CauseEnd& end) const {
  if (end.by == CauseEnd::By::kSuccess) return {.kind = cause_kind::kSuccess, .tick = end.last_tick};
  if (end.by == CauseEnd::By::kOther) return {.kind = end.reason, .tick = end.last_tick};
  std::vector<CauseMoment> moments;
  AddLosses(unmet, &moments);
  AddEmptyGrasps(unmet, &moments);
  AddFalls(unmet, &moments);
  AddCollisions(unmet, end.last_tick, &moments);
  if (moments.empty()) {
    if (end.by == CauseEnd::By::kTime) return MomentWithoutEvent(unmet, end);
    return {.kind = end.reason == "collision" ? cause_kind::kCollision : cause_kind::kFailedCondition,
            .tick = end.last_tick};
  }
  // An object that was put down as the task requires does not explain a failure with another object. A
  // gripper that stayed open does not count as such a failure, because it may have had nothing to do after
  // the object was put down.
  const auto is_harmless = [&](const CauseMoment& moment) {
    return moment.put_down && std::ranges::any_of(moments, [&](const CauseMoment& other) {
             return (!other.put_down || other.tick > moment.tick) && !other.stayed_open &&
                    other.object >= 0 && other.object != moment.object;
           });
  };
  CauseMoment first = *std::ranges::min_element(moments, {}, [&](const CauseMoment& moment) {
    return std::tuple(is_harmless(moment), moment.tick, moment.lost_tick);
  });
  if (first.gripper >= 0) {
    first.tried_again = std::ranges::any_of(closings_.closings(), [&](const EmptyClosing& closing) {
      return closing.gripper == first.gripper && closing.tick > first.tick;
    });
    for (const CauseHold& hold : holds_.holds()) {
      if (hold.gripper != first.gripper || hold.object != first.object || hold.first_tick <= first.tick)
        continue;
      first.held_again = true;
      const bool is_put_down = hold.opened && !HasFallen(hold);
      first.lost_again +=
          hold.is_over && IsGrasp(hold) && hold.pinched_ticks >= Ticks(kShortestHold) && !is_put_down;
    }
  }
  return first;
}

std::string CauseFinder::Reason(const CauseMoment& moment, const std::vector<Unmet>& unmet,
                                const CauseEnd& end) const {
  if (moment.kind == cause_kind::kLostObject) return moment.opened ? "dropped" : "grasp_slip";
  if (moment.kind == cause_kind::kEmptyGrasp) return "grasp_miss";
  if (moment.kind == cause_kind::kCollision || moment.kind == cause_kind::kStall) return moment.kind;
  if (moment.kind == cause_kind::kMissedCondition &&
      std::ranges::any_of(holds_.holds(), [&](const CauseHold& hold) {
        return Length(hold) >= Ticks(kShortestHold) && IsAboutAny(unmet, static_cast<size_t>(hold.object));
      }))
    return "wrong_pose";
  return end.reason;
}

FoundCause CauseFinder::Find(const CauseEnd& end) const {
  const std::vector<Unmet> unmet = FindUnmet();
  const CauseMoment moment = FindMoment(unmet, end);
  cause_t cause{};
  cause.kind = moment.kind;
  cause.tick = moment.tick;
  cause.time_s = Time(moment.tick);
  cause.text = Text(moment, end);
  return {cause, Reason(moment, unmet, end)};
}

}  // namespace evalbus::metrics
