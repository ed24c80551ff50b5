// Records the messages of an episode into a standard LCM event log, one log per episode. Channels with
// Recorded::kNo (for example rendered images) and repeated messages of a tick or an episode are omitted.
// The log is DIR/episodes/0007.partial/events.lcmlog while it grows, and DIR/episodes/0007/events.lcmlog (or
// .zst) once it is complete and synced.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bus/batch_delay.h"
#include "bus/channels.h"
#include "bus/component.h"
#include "bus/event_log.h"
#include "bus/packed_log.h"
#include "bus/recorder/tick_set.h"
#include "bus/wait.h"

namespace evalbus {

class Recorder : public Component {
 public:
  // Events are stamped with simulated time (microseconds since the episode began). Playback at speed 1
  // therefore shows the robot's true speed, independent of the speed of the evaluation. Events of a real-time
  // run are stamped with the wall-clock time of their arrival.
  Recorder(Bus* bus, std::filesystem::path run, LogForm form = LogForm::kPlain);

  void Poll(SteadyTime now) override;

 private:
  void Record(std::string_view channel, std::span<const uint8_t> data, int64_t receive_time_us);
  // Returns false if this MODEL must not be recorded.
  bool OnModel(std::span<const uint8_t> data, int64_t receive_time_us);
  void OnEpisodeBegin(std::span<const uint8_t> data);
  // Returns true if the log of this episode must be opened.
  bool MayBegin(const episode_begin_t& begin);
  void Open(const episode_begin_t& begin);
  void CloseEpisode();
  // Returns the number of ticks, up to the tick of EPISODE_END, whose messages the log lacks: the largest of
  // the numbers of missing STATEs and, unless in real time, CONTACTS, PARTIALs and (without a source)
  // ACTIONs. The ACTION of the last tick may be missing. Returns 0 if the episode was aborted.
  int64_t MissingTicks() const;

  std::filesystem::path run_;
  LogForm form_;
  // Last MODEL; it is published before the episode that it belongs to.
  std::vector<uint8_t> model_;
  int64_t model_time_us_ = 0;
  bool simulated_time_ = true;
  // True if a source moves the robot instead of a policy.
  bool is_watched_ = false;
  // Simulated time of the last STATE.
  int64_t time_us_ = 0;
  std::optional<EventLogWriter> events_;
  // Messages that were received in this episode on a channel with one message per tick.
  struct Received {
    std::vector<uint8_t> last;
    TickSet ticks;
  };
  std::map<std::string, Received, std::less<>> received_;
  channels::Messages decoded_;
  // Copy of the message with session 0, for the log.
  std::vector<uint8_t> without_session_;
  BatchDelay batch_delay_;
  // EPISODE_END and EPISODE_SUMMARY of this episode; the log is complete only after both.
  std::optional<episode_end_t> end_;
  bool has_summary_ = false;
  // Measures the time since both have been received. The log ends with the RUN_SUMMARY that follows, or after
  // kRunSummaryWait without it.
  std::optional<Wait> closing_;
};

}  // namespace evalbus
