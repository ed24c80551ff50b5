// The metrics component. It subscribes to MODEL, EPISODE_BEGIN, STATE, CONTACTS and EPISODE_END. It publishes
// PARTIAL for each tick whose STATE and CONTACTS it has, CRITERIA at a lower rate (see CriteriaPace),
// EPISODE_SUMMARY after each episode, and then RUN_SUMMARY over the episodes so far. RUN_SUMMARY is repeated
// once a second.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "bus/component.h"
#include "bus/conflict_detector.h"
#include "bus/wait.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "metrics/episode/criteria_pace.h"
#include "metrics/episode/episode_scorer.h"
#include "metrics/episode/tick_merger.h"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::metrics {

class MetricsComponent : public Component {
 public:
  // Wall-clock time after EPISODE_END for which ticks may still arrive.
  static constexpr std::chrono::milliseconds kMaxWait{1000};

  // is_part: the run has episodes whose messages this component will not receive.
  explicit MetricsComponent(Bus* bus, bool is_part = false);

  void Poll(SteadyTime now) override;

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnEpisodeEnd(const episode_end_t& end);
  template <class Message>
  void OnTickMessage(const Channel<Message>& channel, const Message& message);
  // Starts scoring the current episode as soon as its model has been received.
  void Prepare();
  void ScoreTicks();
  void PublishCriteria();
  void FinishEpisode();
  void PublishRunSummary();

  // The last MODEL that was new (IsNewModel).
  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // False if the clock of the model that scorer_ was made for is real time.
  bool is_lockstep_ = false;

  std::unique_ptr<EpisodeScorer> scorer_;
  TickMerger merger_;
  ConflictDetector conflicts_;
  episode_begin_t begin_{};
  episode_end_t end_{};
  partial_metrics_t partial_{};
  CriteriaPace criteria_pace_;
  criteria_t criteria_{};
  // True between Prepare() and FinishEpisode().
  bool running_ = false;
  // Set from FinishEpisode() until the next episode begins.
  std::optional<episode_summary_t> summary_;
  // Measures the time since EPISODE_END; set while ticks before it are missing.
  std::optional<Wait> last_ticks_;
  // Number of missing ticks of the earlier episodes.
  int64_t missing_before_ = 0;
  int64_t missing_here_ = 0;
  const bool is_part_;
  RunStatistics statistics_;
  run_summary_t run_summary_{};
  SteadyTime summary_published_{};
};

}  // namespace evalbus::metrics
