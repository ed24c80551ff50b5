// Scores the episodes of a run from STATE and CONTACTS: rollout metrics and task evaluation for one model.
// Pure; what the metrics process does per tick, and what rescoring a log does.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "evalbus/contacts_t.hpp"
#include "evalbus/criteria_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/episode/episode_history.h"
#include "metrics/episode/explanation.h"
#include "metrics/episode/metric_availability.h"
#include "metrics/episode/rollout_metrics.h"
#include "metrics/sample/grasps.h"
#include "metrics/task/task_evaluator.h"

namespace evalbus::metrics {

// The values of an episode are those of its ticks up to its first success or failure: what comes later,
// because the sim goes on for MODEL's after_success_us or has not heard yet, changes none of them. Of the
// ticks later than a first success it is only told how long success held.
class EpisodeScorer {
 public:
  // Throws InputError where the task does not fit the model.
  EpisodeScorer(const model_info_t& model, const TaskDescription& task);
  EpisodeScorer(const EpisodeScorer&) = delete;
  EpisodeScorer& operator=(const EpisodeScorer&) = delete;

  void Start();

  // The next tick, ticks in order; missing ones are counted from the gap. The first tick is the reset state.
  // Contents that are not finite or do not fit the model are refused and counted.
  void Tick(const state_t& state, const contacts_t& contacts);

  // The ticks between the last one and this one (the last of the episode) are missing too.
  void EndAt(int64_t last_tick);

  // The score after the last tick.
  void Partial(partial_metrics_t* partial) const;
  // How every condition of the verdict stands after the last tick (TaskEvaluator::Criteria).
  void Criteria(criteria_t* criteria) const;
  // The final score; header and what else comes from the sim is copied from its messages. Not complete where
  // ticks are missing, samples were refused, the policy's server failed, or the episode was cut short:
  // aborted, or ended on a verdict that these ticks do not give.
  episode_summary_t Summary(const episode_begin_t& begin, const episode_end_t& end) const;

  // As in partial_metrics_t.
  int8_t verdict() const;
  // Simulated time of its tick, microseconds; nothing without one.
  std::optional<int64_t> verdict_time_us() const;
  int64_t missing_ticks() const { return missing_ticks_; }
  int64_t refused_samples() const { return unfit_ticks_ + metrics_.refused_samples(); }

 private:
  bool Fits(const state_t& state) const;
  // Those of a tick but for the geoms of objects whose poses are not known.
  std::span<const contact_t> KnownContacts(const contacts_t& contacts);
  // Sets holding_ and pinched_.
  void FindHolds(std::span<const contact_t> contacts);
  // A tick up to the verdict, and one later than it.
  void Score(const state_t& state, const contacts_t& contacts);
  void WatchSuccess(const state_t& state, const contacts_t& contacts);
  // Fills in every member; with what is too dear to be evaluated at every tick where the episode is over.
  void FillExtended(bool is_over, extended_metrics_t* extended) const;

  model_info_t model_;
  ModelNames names_;
  TaskEvaluator evaluator_;
  MetricAvailability availability_;
  RolloutMetrics metrics_;
  EpisodeHistory history_;
  Grasps grasps_;
  FirstCollision first_collision_;
  std::vector<int> stage_index_;
  std::vector<contact_t> known_contacts_;
  // What STATE must have at least, for the joints of MODEL.
  int num_coordinates_ = 0;
  std::vector<std::vector<std::vector<uint8_t>>> fingers_;  // by gripper, finger, geom: its pads
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
  // Of the tick with the verdict.
  std::optional<header_t> decided_;
  // Ticks later than that at which success held, and whether it does at the last of them.
  int64_t held_ticks_ = 0;
  bool holds_ = false;
  // Storage of the sample, kept.
  std::vector<ArmSample> arms_;
  std::vector<double> opening_;
  std::vector<uint8_t> holding_;
  std::vector<uint8_t> pinched_;
  std::vector<double> height_;
  std::vector<GeomContact> contacts_;
};

}  // namespace evalbus::metrics
