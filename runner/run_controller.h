// Controls the episodes of a run. Commands the sim, collects summaries, and maintains the run folder. Retries
// episodes that were aborted or affected by a failure of the policy's server, and detects components that
// stop publishing. Communicates only over the bus, so that it works identically with processes and in one
// process.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/random.h"
#include "bus/batch_delay.h"
#include "bus/component.h"
#include "bus/conflict_detector.h"
#include "bus/repeater.h"
#include "bus/wait.h"
#include "models/task_family.h"
#include "results/policy_calls.h"
#include "results/run_folder.h"
#include "runner/training_starts.h"

namespace evalbus::runner {

// SHA-256 hashes of the task, the models and the force limits, which are the same for all episodes of a run.
// limits_sha256: empty without force limits.
struct ModelHashes {
  std::string task_sha256, physics_sha256, visual_sha256, limits_sha256;

  static ModelHashes Of(const model_info_t& model);
};

struct RunPlan {
  std::string task;
  std::string variation;
  ModelHashes model_hashes;
  // Numbers of the episodes to run, in this order.
  std::vector<int> episodes;
  // True if the run is resumed with --only, and its run.json has more episodes than that, which may be
  // missing. run.json then does not determine `episodes`.
  bool is_selection = false;
  int64_t seed = 0;
  std::string seed_stream = kRunSeeds;
  SeedSource seeds() const { return {seed, seed_stream, FamilyOf(task), variation}; }
  std::vector<std::string> required;
  // Maximum number of attempts per episode. If all attempts fail, the run is aborted. If the last attempt
  // ended with server_error, the episode is instead marked invalid, and the run continues.
  int max_attempts = 3;
  // True for a real-time run, whose results include the pacing.
  bool realtime = false;
  // True if the policy is an external process, which may start and stop at any time. The run waits at most
  // policy_timeout_s for it.
  bool policy_is_external = false;
  double policy_timeout_s = 60;
  // Schedule of the policy's calls; set for a policy behind a server and for --latency.
  std::optional<results::CallSchedule> calls;
  // Set if the policy's contract names its training sets.
  std::optional<TrainingStarts> trained_on;
  // True for `evalbus watch`: a source moves the robot on its own schedule. There is then no time limit for
  // the start of an episode, and a log may lack data that the source did not send.
  bool is_watched = false;
  // True if users start all components by hand. There are then no time limits for their start and for their
  // STATUS.
  bool is_by_hand = false;
};

// Receives the events of a run for display. The controller's handlers call these functions.
class RunListener {
 public:
  virtual ~RunListener() = default;
  virtual void OnEpisodeBegin(const episode_begin_t&) {}
  virtual void OnPartial(const partial_metrics_t&) {}
  // `episode`: the episode's line of episodes.jsonl.
  virtual void OnEpisodeDone(const nlohmann::ordered_json& /*episode*/) {}
  // Receives a warning, or a line about an error from which the run has recovered.
  virtual void OnRemark(const std::string&) {}
  // Is called every few hundredths of a second of wall time.
  virtual void Poll(SteadyTime) {}
};

class RunController : public Component {
 public:
  RunController(Bus* bus, const RunPlan& plan, const results::RunFolder& folder, RunListener* listener);

  void Poll(SteadyTime now) override;
  bool done() const override { return next_ >= plan_.episodes.size(); }

  // Returns a description of the sim or a required component that has not published STATUS for 10 s, or for
  // 60 s after it was started. Empty if there is none.
  std::string Silent(SteadyTime now);
  // Must be called when the components were started. Timeouts are measured from this call, and episodes start
  // only with these instances (component_status_t). A component without an entry may have any instance.
  void ExpectStart(const std::map<std::string, int64_t>& instances = {});

  // Must be called when components have ended. The current episode is discarded and run again. Throws
  // EnvironmentError after max_attempts.
  void Retry(const std::string& why);

  // Returns one line about the messages that components reported as dropped; empty if there are none.
  std::string DroppedMessages() const;

 private:
  // State of one attempt of an episode. Each attempt starts with a new object.
  struct Attempt {
    int number = 0;
    // True when the MODEL of this run's sim was received. An EPISODE_BEGIN that arrives earlier is kept in
    // early_begin.
    bool own_model_received = false;
    std::optional<episode_begin_t> early_begin, begin;
    bool begun() const { return begin.has_value(); }
    // True when the first score was received.
    bool started = false;
    // Time since the attempt was first polled.
    std::optional<Wait> waiting;
    // True if a process of this run reported an error. The process will exit, and its exit code determines
    // how the run continues.
    bool has_failed_process = false;
    // Error reported by an external policy.
    std::string policy_error;
    // Time since the episode's end, as reported by EPISODE_END or, if that was lost, by the sim's STATUS.
    std::optional<Wait> ended;
    std::optional<episode_end_t> end;
    std::optional<episode_summary_t> summary;
    results::PolicyCalls calls;
    // Time since everything except the finished log was received.
    std::optional<Wait> unrecorded;
    bool recorded = false;
    // Path of a physics model of another run that was received; empty if there was none.
    std::string foreign_model;
  };
  struct Silence {
    Wait wait;
    SteadyTime::duration allowed;
  };
  struct Dropped {
    int64_t decode_errors = 0, foreign_messages = 0;
  };

  int episode_index() const { return plan_.episodes[next_]; }
  bool has_another_try() const { return attempt_.number + 1 < plan_.max_attempts; }
  // Returns the reason why an attempt with this end must be repeated; nullopt if it counts.
  std::optional<std::string> WhyWorthless(const std::string& end_reason, const std::string& detail) const;
  int64_t seed() const;
  void Command();
  void OnModel(const model_info_t& model);
  // Throws InputError if the files that a restarted sim has read again have changed.
  void CheckUnchanged(const model_info_t& model);
  void OnBegin(const episode_begin_t& begin);
  void OnPartial(const partial_metrics_t& partial);
  void OnEnd(const episode_end_t& end);
  void OnSummary(const episode_summary_t& summary);
  void OnStatus(const component_status_t& status);
  void OnLog(const log_t& line);
  void FinishIfRecorded();
  void CheckPolicyComes(SteadyTime::duration waited) const;
  void BeginAgain(const std::string& why);

  RunPlan plan_;
  std::map<std::string, int64_t> instances_;
  // True if messages of other sessions were reported.
  bool foreign_reported_ = false;
  // True if an episode with too few calls of the policy was reported.
  bool rare_calls_reported_ = false;
  const results::RunFolder& folder_;
  RunListener* listener_;
  // Path of the physics model in the run's folder. A MODEL with a different path comes from the sim of
  // another run, which may have answered the COMMAND.
  std::string own_model_;
  // Instance of the last sim that published STATUS before an episode began.
  int64_t sim_ = 0;
  // First MODEL of this run's sim.
  std::optional<model_info_t> model_;
  // Index of the current episode in plan_.episodes.
  size_t next_ = 0;
  Attempt attempt_;
  Repeater command_;
  ConflictDetector conflicts_;
  BatchDelay batch_delay_;
  // Time since the last STATUS of each component, and the timeout.
  std::map<std::string, Silence> silence_;
  // The highest counts that each component has reported.
  std::map<std::string, Dropped> dropped_;
};

}  // namespace evalbus::runner
