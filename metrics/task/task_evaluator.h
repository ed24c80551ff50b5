// Evaluates a task tick by tick: stages, success, failure, distances and pose errors. Pure; compiled once per
// model.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "evalbus/criteria_t.hpp"
#include "metrics/task/expressions.h"
#include "metrics/task/known_objects.h"
#include "models/model_names.h"
#include "models/task_description.h"

namespace evalbus::metrics {

enum class Verdict { kUndecided, kSuccess, kFailure };

class TaskEvaluator {
 public:
  // Throws InputError with file and line for names that the model does not have and for unknown expressions.
  // `names` must outlive this object.
  TaskEvaluator(const TaskDescription& task, const ModelNames& names);

  // Discards the state of the previous episode.
  void Start();

  // Evaluates a tick; ticks must come in order, and world.stage_reached is ignored. The verdict is undecided
  // at tick 0, the reset state. From tick 1 on, the first success or failure is final; failure takes
  // precedence over success at the same tick. A stage that has been reached remains reached. A condition that
  // needs an unknown object pose is never met and yields no verdict. If the failure condition needs one,
  // there is no success either.
  void Evaluate(WorldView world, int64_t tick);

  Verdict verdict() const { return verdict_; }
  const KnownObjects& objects() const { return objects_; }
  // Returns whether success can be judged. This requires that failure can be judged too, because failure
  // takes precedence.
  bool can_succeed() const { return knows_success_ && knows_failure_; }
  bool knows_all_stages() const { return std::ranges::all_of(knows_stage_, std::identity()); }
  // Return whether each stage, target distance and pose error can be evaluated, in the task's order.
  const std::vector<uint8_t>& knows_stage() const { return knows_stage_; }
  const std::vector<uint8_t>& knows_distance() const { return knows_distance_; }
  const std::vector<uint8_t>& knows_error() const { return knows_error_; }
  // Returns whether the success condition is met at the last tick, and there is no failure. The verdict
  // remains final if the condition is no longer met.
  bool success_holds() const { return success_holds_; }
  // Returns whether the failure is the built-in one: a robot body out of bounds.
  bool out_of_bounds() const { return out_of_bounds_; }
  // Returns the deciding conditions: the conditions that made success, or failure, true at the tick of the
  // verdict or, without a verdict, the conditions that keep success from being true.
  std::vector<condition_t> ExplainVerdict() const;
  // Writes every condition of success and failure after the last tick (see Predicate::Stand), except the
  // built-in failure. Before tick 1, no condition holds and all numbers are NaN. Does not allocate if
  // *criteria has been filled before. Does not change the header.
  void Criteria(criteria_t* criteria) const;
  // Writes every condition of each stage, then every condition of success: one list per stage and one more
  // for success. The list of a stage that depends on an object with an unknown pose is empty. Before tick 1,
  // the lists are meaningless.
  void ConditionsByStage(std::vector<std::vector<condition_t>>* conditions) const;
  // Stages, target distances (m) and pose errors (rad), each in the order of TaskDescription.
  const std::vector<uint8_t>& stage_reached() const { return stage_reached_; }
  const std::vector<double>& target_distance() const { return target_distance_; }
  const std::vector<double>& pose_error() const { return pose_error_; }

 private:
  // Returns the index of the robot body that is farthest out of bounds; -1 if there is none.
  int BodyOutOfBounds(const state_t& state) const;

  const ModelNames& names_;
  const KnownObjects objects_;
  bool knows_success_, knows_failure_;
  std::vector<uint8_t> knows_stage_, knows_distance_, knows_error_;

  std::vector<std::unique_ptr<Predicate>> stages_;
  std::unique_ptr<Predicate> success_;
  std::unique_ptr<Predicate> failure_;  // null if only the built-in failure applies
  std::vector<std::unique_ptr<Quantity>> distances_;
  std::vector<std::unique_ptr<Quantity>> errors_;
  std::vector<int> robot_bodies_;

  Verdict verdict_ = Verdict::kUndecided;
  bool success_holds_ = false;
  bool out_of_bounds_ = false;
  // True once a tick after the reset state has been evaluated.
  bool judged_ = false;
  // Deciding conditions at the tick of the verdict.
  std::vector<condition_t> why_;
  std::vector<uint8_t> stage_reached_;
  std::vector<double> target_distance_;
  std::vector<double> pose_error_;
};

}  // namespace evalbus::metrics
