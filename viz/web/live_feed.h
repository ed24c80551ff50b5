// A run that goes on, as viewers are shown it: what viz/watch knows of it, and the episode under way from its
// first tick. Pure: hears messages, gives blocks to a broadcaster. What it needs to know and no message says
// (the scene; what was before we came) others find for it; meanwhile the episode's messages wait here.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/channels.h"
#include "viz/viewer/episode_track.h"
#include "viz/viewer/run_block.h"
#include "viz/watch/run_watch.h"
#include "viz/web/update_broadcaster.h"

namespace evalbus::viz {

class LiveFeed {
 public:
  struct Scene {
    std::string id;
    std::vector<int> bodies;
    // By the episode's seed; as SceneBlocks::Appearance().
    std::function<nlohmann::ordered_json(int64_t)> appearance;
  };
  struct Message {
    std::string channel;
    std::vector<uint8_t> data;
  };

  // Channels that it wants, as Bus::SubscribeRaw takes them.
  static constexpr std::string_view kChannels[] = {
      "EVALBUS_MODEL",           "EVALBUS_EPISODE_BEGIN", "EVALBUS_STATE",  "EVALBUS_CONTACTS",
      "EVALBUS_PARTIAL",         "EVALBUS_CRITERIA",      "EVALBUS_STATUS", "EVALBUS_EPISODE_END",
      "EVALBUS_EPISODE_SUMMARY", "EVALBUS_RUN_SUMMARY",   "EVALBUS_LOG",    "EVALBUS_CAMERA_.*"};
  static bool Uses(std::string_view channel) {
    return std::ranges::find(kChannels, channel) != std::end(kChannels) ||
           channels::Carries(channels::kCameraImage, channel);
  }
  static constexpr auto kRunPeriod = std::chrono::milliseconds(200);
  static constexpr auto kTicksPeriod = std::chrono::milliseconds(33);
  // Between two whole episodes, which are long, where a run is much faster than the robot.
  static constexpr auto kEpisodePeriod = std::chrono::milliseconds(200);
  // Messages that wait for the scene; what is more is lost, and shown as missing.
  static constexpr size_t kMaxWaiting = size_t{64} << 20;

  // run: its number on the broadcaster. planned_episodes: 0 = not known.
  LiveFeed(int run, std::string policy, int planned_episodes)
      : run_(run), policy_(std::move(policy)), watch_(planned_episodes) {}

  // time: of the day, for log lines.
  void Hear(std::string_view channel, std::span<const uint8_t> data, SteadyTime now, const std::string& time);

  // A MODEL whose scene is not known yet; null: none. It is asked for until it is told.
  const std::shared_ptr<const model_info_t>& model_without_scene() const { return wanted_; }
  // Without a scene: there is none, only numbers are shown.
  void SetScene(const std::shared_ptr<const model_info_t>& model, Scene scene);

  // An episode in whose middle we came, to be told what was before.
  std::optional<header_t> episode_without_begin() const;
  // Its messages as its log has them so far; none: nobody knows.
  void SetHistory(const header_t& episode, const std::vector<Message>& messages);

  const RunWatch& watch() const { return watch_; }
  const EpisodeTrack* track() const { return track_.get(); }
  // Episodes that came to an end since the last call.
  std::vector<EpisodeRow> TakeDone() { return std::exchange(done_, {}); }

  // Gives what is new to the broadcaster; to be called about every kTicksPeriod. counted: what the run's
  // folder says, where it has one.
  void Publish(UpdateBroadcaster* broadcaster, const RunLabel& label, const RunNumbers* counted,
               SteadyTime now);

 private:
  bool Enters(std::string_view channel, std::span<const uint8_t> data, header_t* header) const;
  void BeginTrack();
  void Give(std::string_view channel, std::span<const uint8_t> data);
  void PublishEpisode(UpdateBroadcaster* broadcaster, SteadyTime now);

  const int run_;
  const std::string policy_;
  RunWatch watch_;
  std::vector<uint8_t> model_bytes_;
  std::shared_ptr<const model_info_t> model_, wanted_;
  Scene scene_;
  // Episode and attempt that is shown, or will be once its track can be made.
  std::optional<header_t> episode_;
  bool begin_was_heard_ = false, history_is_known_ = false;
  std::vector<Message> waiting_;
  size_t waiting_bytes_ = 0;
  std::unique_ptr<EpisodeTrack> track_;
  // The one before, where the broadcaster does not have its end yet.
  std::unique_ptr<EpisodeTrack> finished_;
  // The broadcaster has an episode of this run at all; what it has of track_.
  bool is_published_ = false, is_given_ = false;
  int given_layout_ = 0;
  int64_t given_ticks_ = 0;
  bool given_over_ = false;
  SteadyTime run_given_{}, episode_given_{};
  std::vector<LogLine> lines_;
  std::vector<EpisodeRow> done_;
  std::optional<std::pair<int32_t, int32_t>> last_done_;
};

}  // namespace evalbus::viz
