// Tracks the state of a run from its messages: progress, current scores, outcomes of the last episodes, and
// health of the components. Pure: it uses no bus, screen or clock. A terminal or a page displays the state.
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

// Returns "idle", "ready", "running", "failed" or "stopped".
const char* StateWord(const component_status_t& status);

class RunWatch {
 public:
  // A component counts as silent if no STATUS has been received from it for longer than this. Each component
  // publishes STATUS about twice a second.
  static constexpr std::chrono::seconds kSilent{2};

  struct Traffic {
    int64_t count = 0;  // number of messages since the beginning of the rate window
    double rate = 0;    // 1/s
  };
  struct Health {
    component_status_t status{};
    SteadyTime received{};
    // Number of ticks by which the component lagged behind the sim when it published this status; -1 if
    // unknown.
    int64_t lag = -1;
    bool silent = false;
    bool is_bad() const { return silent || status.state == component_status_t::FAILED; }
  };

  // planned_episodes: 0 if unknown.
  explicit RunWatch(int planned_episodes = 0) : planned_episodes_(planned_episodes) {}
  RunWatch(const RunWatch&) = delete;
  RunWatch& operator=(const RunWatch&) = delete;

  // Processes a message of the run. Messages must be passed in the order of their arrival. Undecodable
  // messages are counted.
  void Receive(std::string_view channel, std::span<const uint8_t> data, SteadyTime now);
  // Processes a message that is already decoded. It is not counted in the message rates.
  void Receive(const episode_begin_t& begin, SteadyTime now);
  void Receive(const partial_metrics_t& partial, SteadyTime now);

  // Updates rates, speed and silence to `now`. Must be called before they are read.
  void Update(SteadyTime now);

  // Returns the events since the last call, one sentence each.
  std::vector<std::string> TakeEvents() { return std::exchange(events_, {}); }

  int planned_episodes() const { return planned_episodes_; }
  // started: time of the first call of Receive or Update. received_at: time of the last message. Unset before
  // that.
  const std::optional<SteadyTime>& started() const { return started_; }
  const std::optional<SteadyTime>& received_at() const { return received_at_; }
  // Returns whether the component that leads the run or replay (`run`, `replay`, or a sim started by hand)
  // has reported its end. After that, silent components are not a fault.
  bool is_over() const;
  // Seconds since the last message, or since the first call if there was none.
  double SilentFor(SteadyTime now) const;

  const model_info_t* model() const { return model_ ? &*model_ : nullptr; }
  // The message version of MODEL if it is incompatible with this evalbus; otherwise empty.
  const std::string& other_version() const { return other_version_; }
  // Returns the name of a geom, such as "left/pad", or a string such as "geom 12" before MODEL has been
  // received.
  std::string GeomName(int32_t geom) const;

  // Returns the number of the episode; -1 before the first episode.
  int32_t episode() const { return episode_; }
  int32_t attempt() const { return attempt_; }
  // Header of the latest STATE of this episode.
  const header_t* state() const { return state_ ? &*state_ : nullptr; }
  // Empty while the episode is running; then its end reason; and its outcome once it has been scored.
  const std::string& end_reason() const { return end_reason_; }
  // Returns end_reason() or, while it is empty, "running", "waiting for components" or "waiting for the next
  // tick". Empty before the first episode.
  std::string Phase() const;
  // scores(): the latest scores. has_scores(): whether they belong to this attempt. Old scores are kept only
  // so that the layout of the display does not change.
  const partial_metrics_t* scores() const { return partial_ ? &*partial_ : nullptr; }
  bool has_scores() const { return partial_ && partial_->header.episode == episode_ && !partial_is_old_; }
  // contacts(): the latest CONTACTS of this episode. clearance(): the latest CONTACTS with a clearance, which
  // not every tick has.
  const contacts_t* contacts() const { return contacts_ ? &*contacts_ : nullptr; }
  const contacts_t* clearance() const { return clearance_ ? &*clearance_ : nullptr; }
  // Returns the number of simulated seconds per second of wall time over the last second, across episodes.
  double speed() const { return speed_; }
  bool has_rates() const { return has_rates_; }

  // The last finished episodes, newest last.
  const std::deque<episode_summary_t>& done() const { return done_; }
  // EPISODE_END of the last episode with a real-time clock; null if there was none.
  const episode_end_t* pacing() const { return pacing_ ? &*pacing_ : nullptr; }
  const run_summary_t* run() const { return run_ ? &*run_ : nullptr; }

  const std::map<std::string, Health>& health() const { return health_; }
  const std::map<std::string, Traffic, std::less<>>& channels() const { return channels_; }
  // The last log lines of the components, newest last.
  const std::deque<log_t>& log() const { return log_; }
  // Returns the number of messages that could not be decoded.
  int64_t undecodable() const { return undecodable_; }

 private:
  void EnterEpisode(int32_t episode, int32_t attempt);
  void OnState(std::span<const uint8_t> data);
  void OnModel(std::span<const uint8_t> data);
  void Receive(const component_status_t& status, SteadyTime now);
  void Receive(const contacts_t& contacts);
  void Receive(const episode_end_t& end);
  void Receive(const episode_summary_t& summary);
  void Receive(const run_summary_t& run);
  void Receive(log_t line);
  void Simulated(const header_t& header);
  void RollWindow(SteadyTime now);

  int planned_episodes_;
  std::optional<SteadyTime> started_, received_at_;

  std::vector<uint8_t> model_bytes_;
  std::optional<model_info_t> model_;
  std::optional<ModelNames> names_;  // of model_
  std::string other_version_;
  int32_t episode_ = -1, attempt_ = 0;
  // Episode and attempt of the last EPISODE_SUMMARY; reset when an episode begins.
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
  // simulated_us_: latest simulated time received in this episode, us. window_simulated_us_: simulated time
  // that has passed in the rate window, us.
  std::optional<int64_t> simulated_us_;
  int64_t window_simulated_us_ = 0;
  double speed_ = 0;
  bool has_rates_ = false;
  int64_t undecodable_ = 0;
  std::vector<std::string> events_;
};

}  // namespace evalbus::viz
