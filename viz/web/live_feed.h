// Data of an active run for viewers: the state tracked by RunWatch, and the current episode from its first
// tick. Pure: takes messages and passes blocks to a broadcaster. The caller provides the data that the
// messages do not contain: the scene, and the ticks before this process started. Until then, the episode's
// messages are queued.
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
    // Calls SceneBlocks::Appearance() with the episode's seed.
    std::function<nlohmann::ordered_json(int64_t)> appearance;
  };
  struct Message {
    std::string channel;
    std::vector<uint8_t> data;
  };

  // Channels to subscribe to, in the syntax of Bus::SubscribeRaw.
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
  // Minimum interval between `episode` blocks. They are large, and the simulation may be much faster than
  // real time.
  static constexpr auto kEpisodePeriod = std::chrono::milliseconds(200);
  // Maximum size of the messages that are queued until the scene is known, bytes. Further messages are
  // dropped and shown as missing.
  static constexpr size_t kMaxWaiting = size_t{64} << 20;

  // run: index of the run in the broadcaster. planned_episodes: 0 if unknown.
  LiveFeed(int run, std::string policy, int planned_episodes)
      : run_(run), policy_(std::move(policy)), watch_(planned_episodes) {}

  // Processes a message. time: time of day, for log lines.
  void Receive(std::string_view channel, std::span<const uint8_t> data, SteadyTime now,
               const std::string& time);

  // A MODEL whose scene has not been set with SetScene yet; null if there is none.
  const std::shared_ptr<const model_info_t>& model_without_scene() const { return wanted_; }
  // Sets the scene of a MODEL. If it is default-constructed, no scene is available and only numbers are
  // shown.
  void SetScene(const std::shared_ptr<const model_info_t>& model, Scene scene);

  // The current episode, if this process started during it and SetHistory has not been called yet.
  std::optional<header_t> episode_without_begin() const;
  // messages: the messages of the episode that have been recorded in its log so far; empty if there is no
  // log.
  void SetHistory(const header_t& episode, const std::vector<Message>& messages);

  // Adds messages that were lost on the network, for example the end of the episode. messages: all messages
  // in the log of an episode that has ended.
  void Complete(const header_t& episode, const std::vector<Message>& messages);

  const RunWatch& watch() const { return watch_; }
  const EpisodeTrack* track() const { return track_.get(); }
  // Returns the episodes that ended since the last call.
  std::vector<EpisodeRow> TakeDone() { return std::exchange(done_, {}); }

  // Passes updates to the broadcaster. Should be called about every kTicksPeriod. counted: episode counts
  // from the run folder, or null.
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
  // Header (episode and attempt) of the episode that is shown, or that will be shown once its track has been
  // created.
  std::optional<header_t> episode_;
  bool begin_was_heard_ = false, history_is_known_ = false;
  std::vector<Message> waiting_;
  size_t waiting_bytes_ = 0;
  std::unique_ptr<EpisodeTrack> track_;
  // The previous episode, if its end has not been passed to the broadcaster yet.
  std::unique_ptr<EpisodeTrack> finished_;
  // is_published_: whether the broadcaster has any episode of this run. is_given_: whether it has the episode
  // of track_.
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
