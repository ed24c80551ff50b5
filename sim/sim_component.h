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

#include "bus/conflict_detector.h"
#include "bus/wait.h"
#include "sim/durations.h"
#include "sim/episode_component.h"
#include "sim/pacer.h"
#include "sim/world.h"

namespace evalbus::sim {

class SimComponent : public EpisodeComponent {
 public:
  SimComponent(Bus* bus, const SimOptions& options);
  ~SimComponent() override;

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;

 private:
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
  void OnForeign(const std::string& what) override;
  void OnOwnState(std::span<const uint8_t> data);
  void OnOwnEnd(const episode_end_t& end);
  // Ends the episode as aborted, because its result is no longer certain.
  void OnConflict(const std::string& what);

  void BeginNext();
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
           (success_us_ ? *success_us_ + prepared_.info.after_success_us : prepared_.info.time_limit_us);
  }
  int64_t sim_time_us() const override { return phase_ == Phase::kRunning ? state_.header.sim_time_us : 0; }
  void EndInTime() { End(success_us_ ? end_reason::kSuccess : end_reason::kTimeLimit); }

  SimOptions options_;
  World world_;

  std::deque<command_t> queue_;
  command_t command_{};
  state_t state_{};
  Tick tick_;
  int64_t deadline_misses_ = 0;
  // Largest tick of the ACTIONs that were used in this episode.
  int64_t newest_action_ = 0;
  // Simulated time of the first success.
  std::optional<int64_t> success_us_;

  ConflictDetector detector_;
  // Description of the first conflict in this episode; empty if there is none.
  std::string conflict_;
  Pacer pacer_;
  // Only in real time: publication time of each tick's STATE, and latencies of the answers.
  std::vector<SteadyTime> published_;
  Durations action_latency_, partial_latency_;
};

}  // namespace evalbus::sim
