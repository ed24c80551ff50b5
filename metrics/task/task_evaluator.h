// Judges a task tick by tick: stages, success, failure, distances and pose errors. Pure; compiled once for a
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
  // Throws InputError with file and line for names that the model does not have and expressions that do not
  // exist. `names` must outlive this object.
  TaskEvaluator(const TaskDescription& task, const ModelNames& names);

  // Forgets the episode before.
  void Start();

  // The world at a tick, without its stages; ticks in order. The verdict is undecided at tick 0, the reset
  // state; from tick 1 on the first success or failure stands, and failure goes before success. A stage once
  // reached stays so. What needs the pose of an object that is not known is never reached, and gives no
  // verdict: no success either where it is the failure that cannot be judged.
  void Evaluate(WorldView world, int64_t tick);

  Verdict verdict() const { return verdict_; }
  const KnownObjects& objects() const { return objects_; }
  // Success can be judged, and so can failure, which goes before it.
  bool can_succeed() const { return knows_success_ && knows_failure_; }
  bool knows_all_stages() const { return std::ranges::all_of(knows_stage_, std::identity()); }
  // By stage, target_distance and pose_error of the task.
  const std::vector<uint8_t>& knows_stage() const { return knows_stage_; }
  const std::vector<uint8_t>& knows_distance() const { return knows_distance_; }
  const std::vector<uint8_t>& knows_error() const { return knows_error_; }
  // The last tick by itself would be a success. The verdict stands where it no longer would.
  bool success_holds() const { return success_holds_; }
  // The failure is the built-in one: a robot body too far away.
  bool out_of_bounds() const { return out_of_bounds_; }
  // What decided: the conditions that made success, or failure, true at that tick; without a verdict those
  // for which success is not true.
  std::vector<condition_t> ExplainVerdict() const;
  // Why each stage that was not reached is not, then what ExplainVerdict() says.
  std::vector<condition_t> ExplainUnmet() const;
  // Every condition of success and of failure after the last tick (see Predicate::Stand), without the
  // built-in one. Before tick 1 none holds and no number is there (NaN). Filled again, it allocates nothing;
  // header is left as it is.
  void Criteria(criteria_t* criteria) const;
  // In the order of TaskDescription: stages, target_distance (m), pose_error (rad).
  const std::vector<uint8_t>& stage_reached() const { return stage_reached_; }
  const std::vector<double>& target_distance() const { return target_distance_; }
  const std::vector<double>& pose_error() const { return pose_error_; }

 private:
  // The robot body that is furthest out of bounds, -1 where none is.
  int BodyOutOfBounds(const state_t& state) const;

  const ModelNames& names_;
  const KnownObjects objects_;
  bool knows_success_, knows_failure_;
  std::vector<uint8_t> knows_stage_, knows_distance_, knows_error_;

  std::vector<std::unique_ptr<Predicate>> stages_;
  std::unique_ptr<Predicate> success_;
  std::unique_ptr<Predicate> failure_;  // null: none but the built-in one
  std::vector<std::unique_ptr<Quantity>> distances_;
  std::vector<std::unique_ptr<Quantity>> errors_;
  std::vector<int> robot_bodies_;

  Verdict verdict_ = Verdict::kUndecided;
  bool success_holds_ = false;
  bool out_of_bounds_ = false;
  // A tick after the reset state was evaluated.
  bool judged_ = false;
  // Of the tick of the verdict.
  std::vector<condition_t> why_;
  std::vector<uint8_t> stage_reached_;
  std::vector<double> target_distance_;
  std::vector<double> pose_error_;
};

}  // namespace evalbus::metrics
