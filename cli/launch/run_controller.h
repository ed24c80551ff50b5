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
#include "bus/repeater.h"
#include "cli/results/run_folder.h"

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
  // What was heard of one try of an episode. The next one begins with a new one of these.
  struct Attempt {
    int number = 0;
    // Our sim's MODEL was heard since the attempt began; what began before that.
    bool own_model_heard = false;
    std::optional<episode_begin_t> early_begin;
    bool begun = false;
    // Its first score came.
    bool started = false;
    // Since we look, wall time.
    SteadyTime waiting_since{};
    // Of an external policy that said it failed.
    std::string policy_error;
    // When it was over, as the sim said or, where that was lost, as its STATUS showed.
    std::optional<SteadyTime> ended;
    std::optional<episode_end_t> end;
    std::optional<episode_summary_t> summary;
    SteadyTime summarised{};
    bool recorded = false;
    // Physics model of another run that was heard; empty if there was none.
    std::string foreign_model;
  };
  struct Dropped {
    int64_t decode_errors = 0, foreign_messages = 0;
  };

  int episode_index() const { return plan_.episodes[next_]; }
  int64_t seed() const;
  void Command();
  void OnModel(const model_info_t& model);
  void OnBegin(const episode_begin_t& begin);
  void OnPartial(const partial_metrics_t& partial);
  void OnEnd(const episode_end_t& end);
  void OnSummary(const episode_summary_t& summary);
  void OnStatus(const component_status_t& status);
  void OnLog(const log_t& line);
  void FinishIfRecorded();
  void CheckPolicyComes(SteadyTime now) const;
  void BeginAgain(const std::string& why);

  RunPlan plan_;
  const results::RunFolder& folder_;
  RunListener* listener_;
  // The models of our sim are in the run's folder; another one may have answered the COMMAND.
  std::string own_model_;
  // Index in plan_.episodes.
  size_t next_ = 0;
  Attempt attempt_;
  Repeater command_;
  ConflictDetector conflicts_;
  // When each component is silent for too long.
  std::map<std::string, SteadyTime> silent_at_;
  SteadyTime listened_{};
  // By component: the highest counts it has said.
  std::map<std::string, Dropped> dropped_;
};

}  // namespace evalbus::launch
