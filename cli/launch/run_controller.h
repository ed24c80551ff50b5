// Takes a run through its episodes: commands the sim, collects summaries, keeps the run folder, retries what
// was aborted or spoilt by the policy's server, notices who fell silent. Speaks only over the bus, like any
// other listener, so it works alike for processes and in one process.
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
#include "cli/results/policy_calls.h"
#include "cli/results/run_folder.h"

namespace evalbus::launch {

// What every episode of a run is made of, by SHA-256.
struct ModelHashes {
  std::string task_sha256, physics_sha256, visual_sha256;

  static ModelHashes Of(const model_info_t& model);
};

struct RunPlan {
  std::string task;
  std::string variation;
  ModelHashes model_hashes;
  // Which episodes to run, in this order.
  std::vector<int> episodes;
  int64_t seed = 0;
  std::string seed_stream = kRunSeeds;
  SeedSource seeds() const { return {seed, seed_stream, task, variation}; }
  std::vector<std::string> required;
  // Tries per episode before the run gives up; before an episode is invalid, and the run goes on, where the
  // last of them ended with server_error.
  int max_attempts = 3;
  // Episodes then say how well they kept time.
  bool realtime = false;
  // The policy is somebody else's process, which comes and goes as it likes; waited for until it is ready, at
  // most this long.
  bool policy_is_external = false;
  double policy_timeout_s = 60;
  // Of a policy behind a server.
  std::optional<results::CallSchedule> calls;
  // Episodes are a source's, which moves the robot when it likes: any time may pass before one begins, and
  // what the source did not send is missing in its log.
  bool is_watched = false;
  // All of them are somebody else's, who may take as long as a person does; no pauses are judged.
  bool is_by_hand = false;
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
  // The components were started: their silence counts from here, and episodes begin with these instances
  // (component_status_t) alone. Components without one may be any process.
  void ExpectStart(const std::map<std::string, int64_t>& instances = {});

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
    std::optional<episode_begin_t> early_begin, begin;
    bool begun() const { return begin.has_value(); }
    // Its first score came.
    bool started = false;
    // Since we look.
    std::optional<Wait> waiting;
    // A process of ours said that it failed: it is about to end, and how decides what comes next.
    bool has_failed_process = false;
    // Of an external policy that said it failed.
    std::string policy_error;
    // Since it was over, as the sim said or, where that was lost, as its STATUS showed.
    std::optional<Wait> ended;
    std::optional<episode_end_t> end;
    std::optional<episode_summary_t> summary;
    results::PolicyCalls calls;
    // Since nothing but its log is missing.
    std::optional<Wait> unrecorded;
    bool recorded = false;
    // Physics model of another run that was heard; empty if there was none.
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
  // Why what ended like this is worth nothing and begun again; nothing where it is not.
  std::optional<std::string> WhyWorthless(const std::string& end_reason, const std::string& detail) const;
  int64_t seed() const;
  void Command();
  void OnModel(const model_info_t& model);
  // A sim that was started again has read its files again. Throws InputError if they are others now.
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
  // Messages of other sessions were reported.
  bool foreign_reported_ = false;
  // An episode with too few calls of the policy's server was reported.
  bool rare_calls_reported_ = false;
  const results::RunFolder& folder_;
  RunListener* listener_;
  // The models of our sim are in the run's folder; another one may have answered the COMMAND.
  std::string own_model_;
  // Instance of the last sim that said STATUS.
  int64_t sim_ = 0;
  // Our sim's first MODEL.
  std::optional<model_info_t> model_;
  // Index in plan_.episodes.
  size_t next_ = 0;
  Attempt attempt_;
  Repeater command_;
  ConflictDetector conflicts_;
  BatchDelay batch_delay_;
  // Of each component, since it last spoke, and for how long it may be so.
  std::map<std::string, Silence> silence_;
  // By component: the highest counts it has said.
  std::map<std::string, Dropped> dropped_;
};

}  // namespace evalbus::launch
