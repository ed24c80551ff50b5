#include "metrics/task/task_evaluator.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {
namespace {

// Any task fails if a robot body is farther than this from the origin (m).
constexpr double kBounds = 10;

condition_t OutOfBounds(const state_t& state, const std::string& name, int body) {
  const double* p = state.body[body].position_m;
  condition_t condition{};
  condition.predicate = "robot_out_of_bounds";
  condition.kind = condition_t::POSE;
  condition.subject = name;
  condition.holds = true;
  condition.has_value = true;
  condition.value_mixed = std::hypot(p[0], p[1], p[2]);
  condition.comparison = ">=";
  condition.threshold_mixed = kBounds;
  condition.unit = "m";
  condition.tick = state.header.tick;
  condition.time_s = Seconds(state.header.sim_time_us);
  condition.text =
      fmt::format("{} is {:.3g} m from the origin, more than {:g} m", name, condition.value_mixed, kBounds);
  return condition;
}

}  // namespace

TaskEvaluator::TaskEvaluator(const TaskDescription& task, const ModelNames& names)
    : names_(names),
      objects_(names.model(), task),
      knows_success_(objects_.Knows(task.success, task)),
      knows_failure_(objects_.Knows(task.failure, task)),
      stage_reached_(task.stages.size()),
      target_distance_(task.target_distance.size()),
      pose_error_(task.pose_error.size()) {
  const CompileContext context{names, task};
  for (const Stage& stage : task.stages) {
    stages_.push_back(CompilePredicate(stage.when, {names, task, stages_.size()}));
    knows_stage_.push_back(objects_.Knows(stage.when, task));
  }
  success_ = CompilePredicate(task.success, context);
  if (!task.failure.name.empty()) failure_ = CompilePredicate(task.failure, context);
  for (const NamedExpression& d : task.target_distance) {
    distances_.push_back(CompileQuantity(d.expression, context));
    knows_distance_.push_back(objects_.Knows(d.expression, task));
  }
  for (const NamedExpression& e : task.pose_error) {
    errors_.push_back(CompileQuantity(e.expression, context));
    knows_error_.push_back(objects_.Knows(e.expression, task));
  }

  const model_info_t& model = names.model();
  for (int body = 0; body < model.num_bodies; ++body) {
    if (model.entity_kind[model.body_entity[body]] == model_info_t::ROBOT) robot_bodies_.push_back(body);
  }
}

void TaskEvaluator::Start() {
  for (const auto& stage : stages_) stage->Start();
  success_->Start();
  if (failure_) failure_->Start();
  for (const auto& distance : distances_) distance->Start();
  for (const auto& error : errors_) error->Start();
  verdict_ = Verdict::kUndecided;
  judged_ = out_of_bounds_ = success_holds_ = false;
  why_.clear();
  stage_reached_.assign(stage_reached_.size(), 0);
  target_distance_.assign(target_distance_.size(), 0);
  pose_error_.assign(pose_error_.size(), 0);
}

int TaskEvaluator::BodyOutOfBounds(const state_t& state) const {
  int furthest = -1;
  double bound = kBounds * kBounds;
  for (int body : robot_bodies_) {
    const double* p = state.body[body].position_m;
    const double squared = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    if (squared <= bound) continue;
    bound = squared;
    furthest = body;
  }
  return furthest;
}

void TaskEvaluator::Evaluate(WorldView world, int64_t tick) {
  world.stage_reached = stage_reached_;
  for (size_t k = 0; k < distances_.size(); ++k) target_distance_[k] = distances_[k]->Number(world);
  for (size_t k = 0; k < errors_.size(); ++k) pose_error_[k] = errors_[k]->Number(world);
  if (tick == 0) return;
  judged_ = true;
  for (size_t k = 0; k < stages_.size(); ++k) {
    if (stages_[k]->Evaluate(world) && knows_stage_[k]) stage_reached_[k] = 1;
  }
  const bool success = success_->Evaluate(world) && can_succeed();
  const bool failure = failure_ && failure_->Evaluate(world) && knows_failure_;
  const int body = BodyOutOfBounds(world.state);
  success_holds_ = success && !failure && body < 0;
  if (verdict_ != Verdict::kUndecided) return;
  if (body >= 0) {
    verdict_ = Verdict::kFailure;
    out_of_bounds_ = true;
    why_.push_back(OutOfBounds(world.state, names_.model().body_name[body], body));
  } else if (failure) {
    verdict_ = Verdict::kFailure;
    failure_->Explain(&why_);
  } else if (success_holds_) {
    verdict_ = Verdict::kSuccess;
    success_->Explain(&why_);
  }
}

std::vector<condition_t> TaskEvaluator::ExplainVerdict() const {
  if (verdict_ != Verdict::kUndecided || !judged_ || !can_succeed()) return why_;
  std::vector<condition_t> conditions;
  success_->Explain(&conditions);
  return conditions;
}

void TaskEvaluator::Criteria(criteria_t* criteria) const {
  Standing success(&criteria->success), failure(&criteria->failure);
  success_->Stand(true, &success);
  if (failure_) failure_->Stand(true, &failure);
  criteria->num_success = static_cast<int32_t>(criteria->success.size());
  criteria->num_failure = static_cast<int32_t>(criteria->failure.size());
  if (judged_) return;
  for (auto* conditions : {&criteria->success, &criteria->failure}) {
    for (condition_t& condition : *conditions) {
      condition.holds = false;
      if (condition.has_value) condition.value_mixed = std::numeric_limits<double>::quiet_NaN();
      condition.tick = 0;
      condition.time_s = 0;
    }
  }
}

void TaskEvaluator::ConditionsByStage(std::vector<std::vector<condition_t>>* conditions) const {
  conditions->resize(stages_.size() + 1);
  for (size_t k = 0; k < conditions->size(); ++k) {
    if (k < stages_.size() && !knows_stage_[k]) continue;
    Standing standing(&(*conditions)[k], /*completes_groups=*/true);
    (k < stages_.size() ? *stages_[k] : *success_).Stand(true, &standing);
  }
}

}  // namespace evalbus::metrics
