#include "metrics/task/task_evaluator.h"

#include <algorithm>

namespace evalbus {
namespace {

// A robot body further than this from the origin (m) is a failure of any task.
constexpr double kBounds = 10;

}  // namespace

TaskEvaluator::TaskEvaluator(const TaskDescription& task, const ModelNames& names)
    : stage_reached_(task.stages.size()),
      target_distance_(task.target_distance.size()),
      pose_error_(task.pose_error.size()) {
  const CompileContext context{names, task};
  for (const Stage& stage : task.stages) stages_.push_back(CompilePredicate(stage.when, context));
  success_ = CompilePredicate(task.success, context);
  if (!task.failure.name.empty()) failure_ = CompilePredicate(task.failure, context);
  for (const NamedExpression& d : task.target_distance)
    distances_.push_back(CompileQuantity(d.expression, context));
  for (const NamedExpression& e : task.pose_error) errors_.push_back(CompileQuantity(e.expression, context));

  const model_info_t& model = names.model();
  for (int body = 0; body < model.num_bodies; ++body) {
    if (model.entity_kind[model.body_entity[body]] == model_info_t::ROBOT) robot_bodies_.push_back(body);
  }
}

void TaskEvaluator::Start() {
  for (const auto& stage : stages_) stage->Start();
  success_->Start();
  if (failure_) failure_->Start();
  verdict_ = Verdict::kUndecided;
  failure_reason_.clear();
  stage_reached_.assign(stage_reached_.size(), 0);
  target_distance_.assign(target_distance_.size(), 0);
  pose_error_.assign(pose_error_.size(), 0);
}

bool TaskEvaluator::RobotIsOutOfBounds(const state_t& state) const {
  return std::any_of(robot_bodies_.begin(), robot_bodies_.end(), [&](int body) {
    const std::vector<double>& p = state.body_position_m[body];
    return p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > kBounds * kBounds;
  });
}

void TaskEvaluator::Evaluate(const WorldView& world, int64_t tick) {
  for (size_t k = 0; k < distances_.size(); ++k) target_distance_[k] = distances_[k]->Evaluate(world);
  for (size_t k = 0; k < errors_.size(); ++k) pose_error_[k] = errors_[k]->Evaluate(world);
  if (tick == 0) return;
  for (size_t k = 0; k < stages_.size(); ++k) {
    if (stages_[k]->Evaluate(world)) stage_reached_[k] = 1;
  }
  const bool success = success_->Evaluate(world);
  const bool failure = failure_ && failure_->Evaluate(world);
  if (verdict_ != Verdict::kUndecided) return;
  if (RobotIsOutOfBounds(world.state)) {
    verdict_ = Verdict::kFailure;
    failure_reason_ = "robot_out_of_bounds";
  } else if (failure) {
    verdict_ = Verdict::kFailure;
    failure_reason_ = "failure_condition";
  } else if (success) {
    verdict_ = Verdict::kSuccess;
  }
}

}  // namespace evalbus
