// Takes a run through its episodes: commands the sim, collects summaries, keeps the run folder, retries what
// was aborted. Speaks only over the bus, like any other listener, so it works alike for processes and in one
// process.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bus/component.h"
#include "cli/run_folder.h"
#include "evalbus/command_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "metrics/run_statistics.h"

namespace evalbus {

struct RunPlan {
  std::string task;
  std::string variation;
  int episodes = 0;
  int64_t seed = 0;
  std::vector<std::string> required;
  // Tries per episode before the run gives up.
  int max_attempts = 3;
};

// What the run wants shown; called from the controller's handlers.
class RunListener {
 public:
  virtual ~RunListener() = default;
  virtual void OnEpisodeBegin(const episode_begin_t&) {}
  virtual void OnPartial(const partial_metrics_t&) {}
  virtual void OnEpisodeDone(const episode_summary_t&, const run_summary_t& /*so_far*/) {}
  virtual void OnRetry(int /*episode*/, const std::string& /*why*/) {}
  // Called every few hundredths of a second of wall time.
  virtual void Poll(SteadyTime) {}
};

class RunController : public Component {
 public:
  RunController(Bus* bus, const RunPlan& plan, const RunFolder& folder, RunListener* listener);

  void Poll(SteadyTime now) override;
  bool done() const override { return next_ >= plan_.episodes; }

  // The episode in progress is lost with its components, which are gone by now; begin it again. Throws
  // EnvironmentError after max_attempts.
  void Retry(const std::string& why);

  const run_summary_t& summary() const { return summary_; }

 private:
  void Command();
  void OnSummary(const episode_summary_t& summary);
  void FinishIfRecorded();
  void BeginAgain(const std::string& why);

  RunPlan plan_;
  const RunFolder& folder_;
  RunListener* listener_;
  int next_ = 0;
  int attempt_ = 0;
  bool begun_ = false;
  bool recorded_ = false;
  std::optional<episode_summary_t> episode_;
  SteadyTime commanded_{};
  SteadyTime summarised_{};
  std::vector<EpisodeResult> results_;
  run_summary_t summary_{};
};

// One line of episodes.jsonl.
nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary);
// summary.json.
nlohmann::ordered_json SummaryJson(const std::string& task, const std::string& variation,
                                   const run_summary_t& summary);

}  // namespace evalbus
