// The sim as a component: runs episodes over the bus. docs/messages.md describes the protocol.
//
// Lockstep: STATE(k+1) is published when ACTION(k) and PARTIAL(k) have arrived and no component exceeds its
// lag window. The physics of tick k+1 is computed as soon as ACTION(k) has arrived, in parallel with
// collision checking and metrics of tick k in their own processes. If PARTIAL(k) ends the episode, that step
// is dropped and tick k is the last. After a success, the episode continues for MODEL's after_success_us. Its
// end reason remains `success`, unless it is aborted or the policy's server fails.
//
// Real time: the wall clock decides. If an action is late, the previous action is held and a deadline miss is
// counted.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/component.h"
#include "bus/conflict_detector.h"
#include "bus/repeater.h"
#include "bus/wait.h"
#include "lcmtypes/end_reason.h"
#include "sim/durations.h"
#include "sim/pacer.h"
#include "sim/prepared_scene.h"
#include "sim/readiness_tracker.h"
#include "sim/world.h"

namespace evalbus::sim {

class SimComponent : public Component {
 public:
  // Prepares the scene (PrepareScene) and throws its errors.
  SimComponent(Bus* bus, const SimOptions& options);
  ~SimComponent() override;

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;
  bool done() const override { return done_; }

 private:
  enum class Phase {
    kIdle,     // between episodes
    kWaiting,  // EPISODE_BEGIN was published; not all components are ready
    kRunning,  // STATE was published
  };
  // Answers to the last published STATE.
  struct Tick {
    bool has_action = false;
    // The physics of the next tick was computed.
    bool stepped = false;
    // Verdict of the tick's PARTIAL, as in partial_metrics_t; nullopt before the PARTIAL arrives.
    std::optional<int8_t> verdict;
    // Set if the episode must end after this tick's score: reason and detail.
    std::optional<std::pair<std::string, std::string>> end;
    SteadyTime published{};
    // Waiting time for answers since the STATE was published.
    Wait wait{SteadyTime{}};
  };

  void OnCommand(const command_t& command);
  void OnStatus(const component_status_t& status);
  void OnAction(const action_t& action);
  void OnPartial(const partial_metrics_t& partial);
  void OnSummary(const header_t& header);
  // The sim also subscribes to the messages that only a sim publishes. A message that it did not publish
  // itself reveals a second sim or a replayed log.
  void OnOwnModel();
  void OnOwnBegin(const episode_begin_t& begin);
  void OnOwnState(std::span<const uint8_t> data);
  void OnOwnEnd(const episode_end_t& end);
  // Ends the episode as aborted, because its result is no longer certain.
  void OnConflict(const std::string& what);

  void BeginNext();
  void AnnounceEpisode();
  void PublishModel();
  void StartIfReady();
  // Computes the physics of the next tick, at most once, unless the episode ends before it.
  void StepAhead();
  // Publishes the next STATE or ends the episode, if all required answers have arrived.
  void Advance();
  void AdvanceRealtime(SteadyTime now);
  void TimeAnswer(int64_t tick, Durations* latency);
  void PublishState();
  // Repeats STATE if an answer is missing, and ends the episode after the timeout.
  void CheckAnswerTimeouts(SteadyTime now);
  void End(std::string reason, std::string detail = "");
  // Until the first success, the time limit applies. After it, the episode ends after_success_us later.
  bool TimeIsUp() const {
    return state_.header.sim_time_us >=
           (success_us_ ? *success_us_ + scene_.info.after_success_us : scene_.info.time_limit_us);
  }
  void EndInTime() { End(success_us_ ? end_reason::kSuccess : end_reason::kTimeLimit); }

  SimOptions options_;
  PreparedScene scene_;
  std::vector<uint8_t> model_bytes_;
  World world_;

  Phase phase_ = Phase::kIdle;
  bool done_ = false;
  std::deque<command_t> queue_;
  command_t command_{};
  episode_begin_t begin_{};
  state_t state_{};
  episode_end_t end_{};
  Tick tick_;
  int64_t deadline_misses_ = 0;
  // Largest tick of the ACTIONs that were used in this episode.
  int64_t newest_action_ = 0;
  // Simulated time of the first success.
  std::optional<int64_t> success_us_;

  ReadinessTracker readiness_;
  ConflictDetector detector_;
  // Description of the first conflict in this episode; empty if there is none.
  std::string conflict_;
  Pacer pacer_;
  // Only in real time: publication time of each tick's STATE, and latencies of the answers.
  std::vector<SteadyTime> published_;
  Durations action_latency_, partial_latency_;

  Repeater announcement_, model_, unanswered_state_, unanswered_end_;
  int64_t model_published_sim_us_ = 0;
};

}  // namespace evalbus::sim
