// What a listener knows of a run from its messages: where it is, the scores so far, how the last episodes
// ended, who is well. Pure: no bus, no screen, no clock of its own; a terminal or a page draws it.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bus/bus.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/log_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "models/model_names.h"

namespace evalbus::viz {

// "idle", "ready", "running", "failed" or "stopped".
const char* StateWord(const component_status_t& status);

class RunWatch {
 public:
  // A component that says nothing for longer counts as silent (they all speak every 0.4 s).
  static constexpr std::chrono::seconds kSilent{2};

  struct Traffic {
    int64_t count = 0;  // since the window of rates began
    double rate = 0;    // 1/s
  };
  struct Health {
    component_status_t status{};
    SteadyTime heard{};
    // Ticks behind the sim when this was said; -1 where that cannot be told.
    int64_t lag = -1;
    bool silent = false;
    bool is_bad() const { return silent || status.state == component_status_t::FAILED; }
  };

  // planned_episodes: 0 = not known.
  explicit RunWatch(int planned_episodes = 0) : planned_episodes_(planned_episodes) {}
  RunWatch(const RunWatch&) = delete;
  RunWatch& operator=(const RunWatch&) = delete;

  // Any message of the run as it came, in the order of arrival. What does not decode is counted.
  void Hear(std::string_view channel, std::span<const uint8_t> data, SteadyTime now);
  // The same for messages that somebody has decoded; they count in no rate of messages.
  void Hear(const episode_begin_t& begin, SteadyTime now);
  void Hear(const partial_metrics_t& partial, SteadyTime now);

  // Brings rates, speed and silence up to now; before they are read.
  void Update(SteadyTime now);

  // What happened since the last call, a sentence each.
  std::vector<std::string> TakeEvents() { return std::exchange(events_, {}); }

  int planned_episodes() const { return planned_episodes_; }
  // Empty: before the first call of anything; before the first message.
  const std::optional<SteadyTime>& started() const { return started_; }
  const std::optional<SteadyTime>& heard_at() const { return heard_at_; }
  // The run or replay has said so itself; who is silent then is not missed.
  bool is_over() const;
  // Seconds since the last message; since the first call of anything if there was none.
  double SilentFor(SteadyTime now) const;

  const model_info_t* model() const { return model_ ? &*model_ : nullptr; }
  // Where MODEL is of an evalbus whose messages mean something else: which one.
  const std::string& other_version() const { return other_version_; }
  // "left/pad"; "geom 12" as long as MODEL has not come.
  std::string GeomName(int32_t geom) const;

  // -1: none yet.
  int32_t episode() const { return episode_; }
  int32_t attempt() const { return attempt_; }
  // Of the latest STATE of this episode.
  const header_t* state() const { return state_ ? &*state_ : nullptr; }
  // Empty while the episode goes on; then why it ended, and once it is scored how it came out.
  const std::string& end_reason() const { return end_reason_; }
  // "running", "waiting for components", how it ended; empty without an episode.
  std::string Phase() const;
  // The last scores, and whether they are of this attempt; if not, they only keep their place.
  const partial_metrics_t* scores() const { return partial_ ? &*partial_ : nullptr; }
  bool has_scores() const { return partial_ && partial_->header.episode == episode_ && !partial_is_old_; }
  // Of this episode: the last, and the last with a clearance, which not every tick has.
  const contacts_t* contacts() const { return contacts_ ? &*contacts_ : nullptr; }
  const contacts_t* clearance() const { return clearance_ ? &*clearance_ : nullptr; }
  // Simulated seconds per second over the last second, all episodes together.
  double speed() const { return speed_; }
  bool has_rates() const { return has_rates_; }

  // The last episodes that ended, the newest last.
  const std::deque<episode_summary_t>& done() const { return done_; }
  // The last one that ended in real time; null before and in lockstep.
  const episode_end_t* pacing() const { return pacing_ ? &*pacing_ : nullptr; }
  const run_summary_t* run() const { return run_ ? &*run_ : nullptr; }

  const std::map<std::string, Health>& health() const { return health_; }
  const std::map<std::string, Traffic, std::less<>>& channels() const { return channels_; }
  // What the components' logs said last, the newest last.
  const std::deque<log_t>& log() const { return log_; }
  // Messages that did not decode.
  int64_t undecodable() const { return undecodable_; }

 private:
  void EnterEpisode(int32_t episode, int32_t attempt);
  void OnState(std::span<const uint8_t> data);
  void OnModel(std::span<const uint8_t> data);
  void OnStatus(const component_status_t& status, SteadyTime now);
  void OnEpisodeDone(const episode_summary_t& summary);
  void OnRun(const run_summary_t& run);
  void OnLog(log_t line);
  void Simulated(const header_t& header);
  void RollWindow(SteadyTime now);

  int planned_episodes_;
  std::optional<SteadyTime> started_, heard_at_;

  std::vector<uint8_t> model_bytes_;
  std::optional<model_info_t> model_;
  std::optional<ModelNames> names_;  // of model_
  std::string other_version_;
  int32_t episode_ = -1, attempt_ = 0;
  // Episode and attempt of the last EPISODE_SUMMARY since one began.
  std::optional<std::pair<int32_t, int32_t>> summed_up_;
  std::optional<header_t> state_;
  std::string end_reason_;
  std::optional<partial_metrics_t> partial_;
  bool partial_is_old_ = true;
  std::optional<contacts_t> contacts_, clearance_;
  std::deque<episode_summary_t> done_;
  std::optional<run_summary_t> run_;
  std::optional<episode_end_t> pacing_;

  std::map<std::string, Health> health_;
  std::map<std::string, Traffic, std::less<>> channels_;
  std::deque<log_t> log_;
  SteadyTime window_began_{};
  // Latest simulated time heard of in this episode, and how much has passed in the window, microseconds.
  std::optional<int64_t> simulated_us_;
  int64_t window_simulated_us_ = 0;
  double speed_ = 0;
  bool has_rates_ = false;
  int64_t undecodable_ = 0;
  std::vector<std::string> events_;
};

}  // namespace evalbus::viz
