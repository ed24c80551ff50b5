// Takes a run through its episodes: commands the sim, collects summaries, keeps the run folder, retries what
// was aborted, notices who fell silent. Speaks only over the bus, like any other listener, so it works alike
// for processes and in one process.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bus/component.h"
#include "bus/conflict_detector.h"
#include "cli/results/run_folder.h"
#include "evalbus/command_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"

namespace evalbus::launch {

struct RunPlan {
  std::string task;
  std::string variation;
  // Which episodes to run, in this order.
  std::vector<int> episodes;
  int64_t seed = 0;
  std::vector<std::string> required;
  // Tries per episode before the run gives up.
  int max_attempts = 3;
  // Episodes then say how well they kept time.
  bool realtime = false;
  // The policy is somebody else's process, which comes and goes as it likes; waited for until it is ready, at
  // most this long.
  bool policy_is_external = false;
  double policy_timeout_s = 60;
};

// What the run wants shown; called from the controller's handlers.
class RunListener {
 public:
  virtual ~RunListener() = default;
  virtual void OnEpisodeBegin(const episode_begin_t&) {}
  virtual void OnPartial(const partial_metrics_t&) {}
  // The episode's line of episodes.jsonl.
  virtual void OnEpisodeDone(const nlohmann::ordered_json& /*episode*/) {}
  // A line about what went wrong and was mended.
  virtual void OnRemark(const std::string&) {}
  // Called every few hundredths of a second of wall time.
  virtual void Poll(SteadyTime) {}
};

class RunController : public Component {
 public:
  RunController(Bus* bus, const RunPlan& plan, const results::RunFolder& folder, RunListener* listener);

  void Poll(SteadyTime now) override;
  bool done() const override { return next_ >= plan_.episodes.size(); }

  // Who, of those that must take part, has not said STATUS for too long: ten seconds, or a minute after a
  // start; empty while all is well.
  std::string Silent(SteadyTime now);
  // The components were started: their silence counts from here.
  void ExpectStart();

  // The episode in progress is lost with its components, which are gone by now; begin it again. Throws
  // EnvironmentError after max_attempts.
  void Retry(const std::string& why);

  // What the components have said that they dropped, as one line; empty if they dropped nothing.
  std::string DroppedMessages() const;

 private:
  int episode_index() const { return plan_.episodes[next_]; }
  void Command();
  void OnBegin(const episode_begin_t& begin);
  void OnEnd(const episode_end_t& end);
  void OnSummary(const episode_summary_t& summary);
  int64_t seed() const;
  void FinishIfRecorded();
  void OnStatus(const component_status_t& status);
  void CheckPolicyComes(SteadyTime now) const;
  void BeginAgain(const std::string& why);
  // Forgets what was heard of the attempt before.
  void StartAttempt(int attempt);

  struct Dropped {
    int64_t decode_errors = 0, foreign_messages = 0;
  };

  RunPlan plan_;
  const results::RunFolder& folder_;
  RunListener* listener_;
  // Index in plan_.episodes.
  size_t next_ = 0;
  int attempt_ = 0;
  // Our sim's MODEL was heard since the attempt began; what began before that.
  bool own_model_heard_ = false;
  std::optional<episode_begin_t> early_begin_;
  bool begun_ = false;
  // Its first score came.
  bool started_ = false;
  bool recorded_ = false;
  SteadyTime waiting_since_{};
  std::string policy_error_;
  std::optional<episode_end_t> end_;
  std::optional<episode_summary_t> episode_;
  SteadyTime commanded_{};
  SteadyTime summarised_{};
  ConflictDetector conflicts_;
  // Physics model of another run, heard since the attempt began; empty if there was none.
  std::string foreign_model_;
  // When the sim said that the episode is over.
  std::optional<SteadyTime> ended_;
  // When each component is silent for too long.
  std::map<std::string, SteadyTime> silent_at_;
  SteadyTime listened_{};
  // By component: the highest counts it has said.
  std::map<std::string, Dropped> dropped_;
};

}  // namespace evalbus::launch
