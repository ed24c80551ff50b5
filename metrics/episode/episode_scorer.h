// Scores the episodes of a run from STATE and CONTACTS: rollout metrics and task evaluation for one model.
// Pure. Used at every tick by the metrics component, and for rescoring logs.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "evalbus/body_pose_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/criteria_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/episode/cause_recorder.h"
#include "metrics/episode/explanation.h"
#include "metrics/episode/force_reader.h"
#include "metrics/episode/limit_checker.h"
#include "metrics/episode/metric_availability.h"
#include "metrics/episode/rollout_metrics.h"
#include "metrics/sample/grasps.h"
#include "metrics/task/task_evaluator.h"

namespace evalbus::metrics {

// The values of an episode cover its ticks up to the first success or failure. Later ticks occur
// because the sim continues for MODEL's after_success_us, or because it has not yet received the verdict.
// These ticks change no value except the counts of missing and refused ticks. After a success, they also
// determine how long success held.
class EpisodeScorer {
 public:
  // Throws InputError if the task, or the force limits in `model`, do not fit the model.
  EpisodeScorer(const model_info_t& model, const TaskDescription& task);
  EpisodeScorer(const EpisodeScorer&) = delete;
  EpisodeScorer& operator=(const EpisodeScorer&) = delete;

  void Start();

  // Adds the next tick, in tick order. If tick numbers are skipped, the skipped ticks count as missing.
  // Tick 0 is the reset state. Ticks with non-finite numbers, or that do not fit the model, are refused
  // and counted.
  void Tick(const state_t& state, const contacts_t& contacts);

  // Counts the ticks after the last added tick, up to last_tick, as missing. last_tick: the episode's last
  // tick.
  void EndAt(int64_t last_tick);

  // Score after the last tick added.
  void Partial(partial_metrics_t* partial) const;
  // State of every condition of the verdict after the last tick (TaskEvaluator::Criteria).
  void Criteria(criteria_t* criteria) const;
  // Returns the final score; its header and the members set by the sim are copied from the sim's messages.
  // The episode is incomplete if ticks are missing, samples were refused, the policy's server failed, or the
  // episode was cut short: aborted, or ended on a verdict that these ticks do not confirm.
  episode_summary_t Summary(const episode_begin_t& begin, const episode_end_t& end) const;

  // Returns the verdict, with the values of partial_metrics_t.
  int8_t verdict() const;
  // Returns the simulated time of the verdict's tick, microseconds; nullopt if there is no verdict.
  std::optional<int64_t> verdict_time_us() const;
  int64_t missing_ticks() const { return missing_ticks_; }
  int64_t refused_samples() const { return unfit_ticks_ + metrics_.refused_samples(); }

 private:
  bool Fits(const state_t& state) const;
  // Returns the contacts of a tick, without contacts of objects whose poses are unknown.
  std::span<const contact_t> KnownContacts(const contacts_t& contacts);
  // Sets holding_ and pinched_ from the contacts.
  void FindHolds(std::span<const contact_t> contacts);
  // Score() handles a tick up to the verdict, WatchSuccess() a later one.
  void Score(const state_t& state, const contacts_t& contacts);
  void WatchSuccess(const state_t& state, const contacts_t& contacts);
  void KeepPoses(const state_t& state);
  // Fills in every member. is_over: the episode has ended, so values that are too expensive to compute at
  // every tick are computed too.
  void FillExtended(bool is_over, extended_metrics_t* extended) const;

  model_info_t model_;
  ModelNames names_;
  TaskEvaluator evaluator_;
  MetricAvailability availability_;
  RolloutMetrics metrics_;
  ForceReader forces_;
  LimitChecker limits_;
  Grasps grasps_;
  FirstCollision first_collision_;
  std::optional<CauseRecorder> cause_;  // always set
  std::vector<int> stage_index_;
  std::vector<contact_t> known_contacts_;
  // Minimum number of joint coordinates in STATE, as required by the joints of MODEL.
  int num_coordinates_ = 0;
  std::vector<std::vector<std::vector<uint8_t>>> fingers_;  // pads, by gripper, then finger, then geom
  std::vector<std::vector<uint8_t>> objects_;               // by object, then geom
  std::vector<int> object_body_;

  header_t header_{};
  bool started_ = false;
  int64_t next_tick_ = 0;
  int64_t missing_ticks_ = 0;
  int64_t unfit_ticks_ = 0;
  int64_t action_clips_ = 0;
  int64_t unreachable_poses_ = 0;
  int64_t singular_poses_ = 0;
  int64_t deadline_misses_ = 0;
  // Header of the tick at which the verdict was reached.
  std::optional<header_t> decided_;
  // Poses at the last scored tick, in the order of episode_summary_t. The names never change.
  std::vector<std::string> final_pose_name_;
  std::vector<body_pose_t> final_pose_;
  // Number of ticks after the verdict at which success held, and whether success holds at the last tick.
  int64_t held_ticks_ = 0;
  bool holds_ = false;
  // Storage of the current sample, reused.
  std::vector<ArmSample> arms_;
  std::vector<double> opening_;
  std::vector<uint8_t> holding_;
  std::vector<uint8_t> pinched_;
  std::vector<GeomContact> contacts_;
};

}  // namespace evalbus::metrics
