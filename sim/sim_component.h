// The sim as a component: runs episodes over the bus. See docs/messages.md for the protocol.
//
// lockstep: STATE(k+1) is published when ACTION(k) and PARTIAL(k) are there and no windowed consumer lags too
// far. The physics of tick k+1 is computed as soon as ACTION(k) is there, beside collision checking and
// metrics of tick k in their own processes; should PARTIAL(k) bring a verdict, that step is dropped and the
// episode ends at tick k. realtime: the wall clock decides; a late action means that the last one is held and
// a deadline miss counted.
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/component.h"
#include "bus/conflict_detector.h"
#include "evalbus/command_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "models/scene.h"
#include "sim/world.h"

namespace evalbus::sim {

struct SimOptions {
  // As FindTask takes it.
  std::string task;
  // Robot YAML; empty = the task's own.
  std::string robot;
  std::vector<std::filesystem::path> model_path;
  std::string run_id = "run";
  // Run folder; the models are written to OUT/model/.
  std::filesystem::path out;
  double control_hz = 50;
  // Rate of simulated time at which collision evaluates the clearance; 0 = never.
  double clearance_hz = 10;
  bool realtime = false;
  // Simulated seconds per wall-clock second, realtime only.
  double rtf = 1;
  // Wall-clock time to wait in lockstep for an action and for a score.
  double policy_timeout_s = 60;
  double metrics_timeout_s = 10;
  // Not zero: run this many episodes without waiting for a COMMAND, then be done.
  int episodes = 0;
  int64_t seed = 0;
  // Who must be ready before tick 0 of such an episode.
  std::vector<std::string> required = {"collision", "metrics", "policy"};
};

class SimComponent : public Component {
 public:
  // Composes and compiles the scene, writes the models. Throws InputError.
  SimComponent(Bus* bus, const SimOptions& options);

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;
  bool done() const override { return done_; }

 private:
  enum class Phase {
    kIdle,     // between episodes
    kWaiting,  // EPISODE_BEGIN is out, not everybody is ready
    kRunning,  // STATE(tick_) is out
  };
  struct Consumer {
    int32_t episode = -1, attempt = -1;
    bool ready = false;
    int64_t last_tick = -1;
    int64_t lag_window_ticks = 0;
  };

  void OnCommand(const command_t& command);
  void OnStatus(const component_status_t& status);
  void OnAction(const action_t& action);
  void OnPartial(const partial_metrics_t& partial);
  void OnSummary(const header_t& header);
  // Messages that only the sim publishes come back to it, as those of anybody else would come.
  void OnOwnModel();
  void OnOwnBegin(const episode_begin_t& begin);
  void OnOwnEnd(const episode_end_t& end);
  // What this episode's result would be cannot be told any more: it ends as aborted.
  void OnConflict(const std::string& what);

  void BeginNext();
  void AnnounceEpisode();
  void PublishModel();
  void StartIfReady();
  // Publishes the next STATE or ends the episode, if what that needs is there.
  void Advance();
  void AdvanceRealtime(SteadyTime now);
  void PublishState();
  void End(const std::string& reason, const std::string& detail = "");
  void FillPacing(episode_end_t* end);
  bool ConsumersKeepUp() const;
  std::string MissingComponents() const;
  bool TimeIsUp() const { return state_.header.sim_time_us >= model_info_.time_limit_us; }

  SimOptions options_;
  TaskDescription task_;
  std::string variation_;
  RobotDescription robot_;
  Scene scene_;
  model_info_t model_info_{};
  std::optional<World> world_;

  Phase phase_ = Phase::kIdle;
  bool done_ = false;
  std::deque<command_t> queue_;
  command_t command_{};
  episode_begin_t begin_{};
  std::map<std::string, Consumer> consumers_;
  ConflictDetector conflicts_;
  std::string conflict_;
  // Of each component that is ready for this episode, who it is.
  std::map<std::string, int64_t> instances_;
  std::vector<uint8_t> model_bytes_;
  SteadyTime announced_{};
  SteadyTime model_published_{};
  int64_t model_published_sim_us_ = 0;

  // The episode's current tick: what of it has arrived.
  state_t state_{};
  bool has_action_ = false;
  bool has_partial_ = false;
  int8_t verdict_ = partial_metrics_t::UNDECIDED;
  // Set when the episode must end after this tick's score: reason and detail.
  std::optional<std::pair<std::string, std::string>> pending_end_;
  SteadyTime state_published_{};
  // The last time it was said, again.
  SteadyTime state_said_{};
  // EPISODE_END is repeated until the next episode begins.
  episode_end_t end_{};
  SteadyTime end_said_{};

  // realtime
  SteadyTime deadline_{};
  int64_t deadline_misses_ = 0;
  int64_t late_ticks_ = 0;
  // Of each STATE after the reset state, how long after its due time it went out.
  std::vector<double> pacing_error_s_;
};

}  // namespace evalbus::sim
