// Writes what is on the bus during an episode, but images and a tick's message that is said again, into a
// standard LCM event log, one log per episode: DIR/episodes/0007.partial/events.lcmlog while it grows,
// DIR/episodes/0007/events.lcmlog, or .zst of it, once it is complete and synced.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
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
  // Events are stamped with simulated time (microseconds since the episode began), so that
  // a player at speed 1 shows the episode as fast as the robot moves, however fast it was evaluated; those of
  // a realtime run are stamped with the wall-clock time of their arrival.
  Recorder(Bus* bus, std::filesystem::path run, LogForm form = LogForm::kPlain);

  void Poll(SteadyTime now) override;

 private:
  void Record(std::string_view channel, std::span<const uint8_t> data, int64_t receive_time_us);
  // False: not the one to record.
  bool OnModel(std::span<const uint8_t> data, int64_t receive_time_us);
  void OnEpisodeBegin(std::span<const uint8_t> data);
  // True if the log of the episode that begins is to be opened.
  bool MayBegin(const episode_begin_t& begin);
  void Open(const episode_begin_t& begin);
  void CloseEpisode();
  // Ticks before EPISODE_END of which the log lacks a message that was sent, as far as that is known.
  int64_t MissingTicks() const;

  std::filesystem::path run_;
  LogForm form_;
  // Last MODEL, which comes before the episode that it belongs to.
  std::vector<uint8_t> model_;
  int64_t model_time_us_ = 0;
  bool simulated_time_ = true;
  // A source moves the robot, and nobody acts.
  bool is_watched_ = false;
  // Simulated time of the last STATE.
  int64_t time_us_ = 0;
  std::optional<EventLogWriter> events_;
  // Of a channel on which a tick's messages are, in this episode.
  struct Heard {
    std::vector<uint8_t> last;
    TickSet ticks;
  };
  std::map<std::string, Heard, std::less<>> heard_;
  channels::Messages decoded_;
  // The message to be recorded, with session 0.
  std::vector<uint8_t> without_session_;
  BatchDelay batch_delay_;
  // EPISODE_END is the sim's, so a summary without it is not of this episode.
  std::optional<episode_end_t> end_;
  bool has_summary_ = false;
  // Since both: RUN_SUMMARY follows, and is the last message recorded.
  std::optional<Wait> closing_;
};

}  // namespace evalbus
