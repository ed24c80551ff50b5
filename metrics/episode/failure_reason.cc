#include "metrics/episode/failure_reason.h"

#include <algorithm>

#include "lcmtypes/end_reason.h"

namespace evalbus::metrics {
namespace {

// Returns whether the operand names an entity of the robot, a part of one, or a gripper.
bool IsOfRobot(const std::string& operand, const model_info_t& model) {
  for (int k = 0; k < model.num_entities; ++k) {
    const std::string& entity = model.entity_name[k];
    if (model.entity_kind[k] == model_info_t::ROBOT &&
        (operand == entity || operand.starts_with(entity + "/")))
      return true;
  }
  return std::ranges::any_of(
      model.gripper, [&](const gripper_info_t& gripper) { return operand == gripper.name + "_gripper"; });
}

bool IsContactOfRobot(const condition_t& condition, const model_info_t& model) {
  return condition.kind == condition_t::CONTACT && condition.holds &&
         (IsOfRobot(condition.subject, model) || IsOfRobot(condition.other, model));
}

}  // namespace

CauseEnd MakeCauseEnd(const EpisodeOutcome& outcome) {
  using By = CauseEnd::By;
  CauseEnd end{.by = By::kOther,
               .reason = outcome.end_reason,
               .detail = outcome.end_detail,
               .last_tick = outcome.last_tick,
               .conditions = outcome.conditions};
  if (outcome.end_reason == end_reason::kServerError) return end;
  if (outcome.verdict == Verdict::kSuccess) {
    end.by = By::kSuccess;
    end.reason.clear();
  } else if (outcome.verdict == Verdict::kFailure && outcome.out_of_bounds) {
    end.reason = "robot_out_of_bounds";
    if (!end.conditions.empty()) end.detail = end.conditions[0].text;
  } else if (outcome.verdict == Verdict::kFailure) {
    end.by = By::kFailure;
    const bool is_collision = std::ranges::any_of(outcome.conditions, [&](const condition_t& condition) {
      return IsContactOfRobot(condition, outcome.names.model());
    });
    end.reason = is_collision ? "collision" : "failure_condition";
  } else if (outcome.end_reason == end_reason::kSuccess || outcome.end_reason == end_reason::kFailure) {
    end.reason = kUnconfirmed;
  } else if (outcome.end_reason == end_reason::kTimeLimit || outcome.end_reason == end_reason::kEndOfData) {
    end.by = outcome.can_succeed ? By::kTime : By::kOther;
    if (!outcome.can_succeed) {
      end.reason = end_reason::kNotJudged;
    } else if (outcome.end_reason == end_reason::kTimeLimit) {
      end.reason = "timeout";
    }
  }
  return end;
}

}  // namespace evalbus::metrics
