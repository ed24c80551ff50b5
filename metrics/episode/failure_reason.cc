#include "metrics/episode/failure_reason.h"

#include <algorithm>

#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"

namespace evalbus::metrics {
namespace {

// A robot that touches the scene for this long (s) up to the end is stuck.
constexpr double kStuck = 1;

// Whether the operand names the entity or a part of it.
bool IsPartOf(const std::string& operand, const std::string& entity) {
  return operand == entity || operand.starts_with(entity + "/");
}

// Index of the object that an operand belongs to; -1 if it belongs to none.
int ObjectOf(const std::string& operand, const model_info_t& model) {
  for (int k = 0; k < model.num_objects; ++k) {
    if (IsPartOf(operand, model.object_name[k])) return k;
  }
  return -1;
}

bool IsOfRobot(const std::string& operand, const model_info_t& model) {
  for (int k = 0; k < model.num_entities; ++k) {
    if (model.entity_kind[k] == model_info_t::ROBOT && IsPartOf(operand, model.entity_name[k])) return true;
  }
  return std::any_of(model.gripper.begin(), model.gripper.end(),
                     [&](const gripper_info_t& gripper) { return operand == gripper.name + "_gripper"; });
}

// Whether the condition is about an object that a gripper has held. still_held: it may still be held;
// otherwise it must have been released.
bool IsAboutAHeldObject(const condition_t& condition, const EpisodeOutcome& outcome, bool still_held) {
  for (const std::string* operand : {&condition.subject, &condition.other}) {
    const int object = ObjectOf(*operand, outcome.names.model());
    if (object < 0 || !outcome.history.WasHeld(object)) continue;
    if (still_held || !outcome.history.IsHeld(object)) return true;
  }
  return false;
}

std::string ReasonOfFailureCondition(const EpisodeOutcome& outcome) {
  if (outcome.out_of_bounds) return "robot_out_of_bounds";
  for (const condition_t& condition : outcome.conditions) {
    if (IsAboutAHeldObject(condition, outcome, true)) return "dropped";
  }
  for (const condition_t& condition : outcome.conditions) {
    if (condition.kind == condition_t::CONTACT && condition.holds &&
        (IsOfRobot(condition.subject, outcome.names.model()) ||
         IsOfRobot(condition.other, outcome.names.model()))) {
      return "collision";
    }
  }
  return "failure_condition";
}

bool Dropped(const EpisodeOutcome& outcome) {
  for (int object = 0; object < outcome.names.model().num_objects; ++object) {
    if (outcome.history.Fell(object)) return true;
  }
  return false;
}

// Whether an object slipped from a gripper and that gripper has not held it since. If another gripper holds
// it now, it counts only if the task requires the gripper that lost it.
bool Slipped(const EpisodeOutcome& outcome) {
  return std::any_of(outcome.slips.begin(), outcome.slips.end(), [&](const Slip& slip) {
    if (outcome.history.LastHeldTick(slip.object, slip.gripper) >= slip.tick) return false;
    if (!outcome.history.IsHeld(slip.object)) return true;
    return std::any_of(outcome.unmet.begin(), outcome.unmet.end(), [&](const condition_t& condition) {
      return condition.kind == condition_t::HOLDING && !condition.holds &&
             ObjectOf(condition.subject, outcome.names.model()) == slip.object &&
             condition.other == outcome.names.model().gripper[slip.gripper].name;
    });
  });
}

bool Stuck(const EpisodeOutcome& outcome) {
  const int64_t since = outcome.history.touching_since();
  const double dt = ControlPeriod(outcome.names.model());
  return since >= 0 && TickTime(outcome.last_tick - since, dt) >= kStuck;
}

// Whether a gripper that should hold an object has closed on nothing and has never held it.
bool Missed(const EpisodeOutcome& outcome) {
  return std::any_of(outcome.unmet.begin(), outcome.unmet.end(), [&](const condition_t& condition) {
    if (condition.kind != condition_t::HOLDING || condition.holds) return false;
    const int object = ObjectOf(condition.subject, outcome.names.model());
    if (object < 0) return false;
    // For "any" and "first", one gripper that has held the object is enough; for "other", look for one that
    // has not.
    if ((condition.other == "any" || condition.other == "first") && outcome.history.WasHeld(object))
      return false;
    for (int k = 0; k < outcome.names.model().num_grippers; ++k) {
      const std::string& name = outcome.names.model().gripper[k].name;
      const bool is_asked = condition.other == name || condition.other == "any" ||
                            condition.other == "first" || condition.other == "other";
      if (is_asked && outcome.history.ClosedOnNothing(k) && outcome.history.LastHeldTick(object, k) < 0)
        return true;
    }
    return false;
  });
}

bool IsInWrongPose(const EpisodeOutcome& outcome) {
  return std::any_of(outcome.conditions.begin(), outcome.conditions.end(), [&](const condition_t& condition) {
    return IsAboutAHeldObject(condition, outcome, condition.kind == condition_t::POSE);
  });
}

}  // namespace

std::string FailureReason(const EpisodeOutcome& outcome) {
  if (outcome.end_reason == end_reason::kServerError) return outcome.end_reason;
  if (outcome.verdict == Verdict::kSuccess) return "";
  if (outcome.verdict == Verdict::kFailure) return ReasonOfFailureCondition(outcome);
  if (outcome.end_reason == end_reason::kSuccess || outcome.end_reason == end_reason::kFailure) {
    return kUnconfirmed;
  }
  if (outcome.end_reason != end_reason::kTimeLimit && outcome.end_reason != end_reason::kEndOfData) {
    return outcome.end_reason;
  }
  if (!outcome.can_succeed) return end_reason::kNotJudged;
  if (Dropped(outcome)) return "dropped";
  if (Slipped(outcome)) return "grasp_slip";
  if (Stuck(outcome)) return "collision";
  if (Missed(outcome)) return "grasp_miss";
  if (IsInWrongPose(outcome)) return "wrong_pose";
  return outcome.end_reason == end_reason::kEndOfData ? outcome.end_reason : "timeout";
}

}  // namespace evalbus::metrics
