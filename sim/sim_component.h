// The sim as a component: runs episodes over the bus. See docs/messages.md for the protocol.
//
// lockstep: STATE(k+1) is published when ACTION(k) and PARTIAL(k) are there and no windowed consumer lags too
// far. The physics of tick k+1 is computed as soon as ACTION(k) is there, beside collision checking and
// metrics of tick k in their own processes; should PARTIAL(k) end the episode, that step is dropped and tick
// k is the last. After a success the episode goes on for MODEL's after_success_us; nothing that ends it then
// changes the verdict. realtime: the wall clock decides; a late action means that the last one is held and a
// deadline miss counted.
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
  // Composes and compiles the scene, writes the models. Throws InputError.
  SimComponent(Bus* bus, const SimOptions& options);
  ~SimComponent() override;

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;
  bool done() const override { return done_; }

 private:
  enum class Phase {
    kIdle,     // between episodes
    kWaiting,  // EPISODE_BEGIN is out, not everybody is ready
    kRunning,  // STATE is out
  };
  // What has arrived of the tick whose STATE is out.
  struct Tick {
    bool has_action = false;
    // The physics of the next one was computed.
    bool stepped = false;
    // Of the score, once it is there: as in partial_metrics_t.
    std::optional<int8_t> verdict;
    // The episode must end after this tick's score: reason and detail.
    std::optional<std::pair<std::string, std::string>> end;
    SteadyTime published{};
    // For answers, since then.
    Wait wait{SteadyTime{}};
  };

  void OnCommand(const command_t& command);
  void OnStatus(const component_status_t& status);
  void OnAction(const action_t& action);
  void OnPartial(const partial_metrics_t& partial);
  void OnSummary(const header_t& header);
  // Messages that only the sim publishes come back to it, as those of anybody else would come.
  void OnOwnModel();
  void OnOwnBegin(const episode_begin_t& begin);
  void OnOwnState(std::span<const uint8_t> data);
  void OnOwnEnd(const episode_end_t& end);
  // What this episode's result would be cannot be told any more: it ends as aborted.
  void OnConflict(const std::string& what);

  void BeginNext();
  void AnnounceEpisode();
  void PublishModel();
  void StartIfReady();
  // The physics of the next tick, unless there is to be none; once.
  void StepAhead();
  // Publishes the next STATE or ends the episode, if what that needs is there.
  void Advance();
  void AdvanceRealtime(SteadyTime now);
  void TimeAnswer(int64_t tick, Durations* latency);
  void PublishState();
  // Says again, and ends the episode, where an answer does not come.
  void CheckAnswerTimeouts(SteadyTime now);
  void End(std::string reason, std::string detail = "");
  // The time limit holds until the first success, and after_success_us from there.
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
  // Simulated time of the first success.
  std::optional<int64_t> success_us_;

  ReadinessTracker readiness_;
  ConflictDetector detector_;
  // The first line about a conflict of this episode; empty without one.
  std::string conflict_;
  Pacer pacer_;
  // Realtime clock: when the STATE of each tick was published, and what its answers took.
  std::vector<SteadyTime> published_;
  Durations action_latency_, partial_latency_;

  Repeater announcement_, model_, unheard_state_, unheard_end_;
  int64_t model_published_sim_us_ = 0;
};

}  // namespace evalbus::sim
