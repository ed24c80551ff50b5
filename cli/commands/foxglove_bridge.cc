// Implements `evalbus bridge foxglove`, which serves an active run or a recorded episode to Foxglove.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "base/errors.h"
#include "bus/attach.h"
#include "bus/bus.h"
#include "bus/host.h"
#include "bus/live_runs.h"
#include "cli/commands/commands.h"
#include "export/foxglove_server.h"
#include "export/recording.h"
#include "results/episode_logs.h"

namespace evalbus::commands {
namespace {

using std::chrono::steady_clock;

constexpr auto kFrame = std::chrono::milliseconds(20);

struct FoxgloveOptions {
  Address address;
  std::vector<int> episode;
  exports::FoxgloveServer::Options server;
};

void AddOptions(CLI::App* app, FoxgloveOptions* options) {
  AddAddressOptions(app, &options->address);
  app->add_option("--episode", options->episode,
                  "recorded episode of the run to play; default: the first finished one")
      ->expected(1);
  app->add_option("--port", options->server.port, "port to listen on; 0: any free port")
      ->capture_default_str();
  app->add_option(
         "--listen", options->server.host,
         "IP address to listen on; unless it is a loopback address, every client that can reach it can watch")
      ->capture_default_str();
  app->add_option("--allow-origin", options->server.origins,
                  "also accept connections from web pages of this origin; those of https://app.foxglove.dev "
                  "are always accepted");
}

void PrintAddress(const exports::FoxgloveServer& server, const FoxgloveOptions& options,
                  const std::string& what) {
  fmt::print(
      "{}\n"
      "in Foxglove: Open connection, Foxglove WebSocket, ws://{}:{}\n",
      what, options.server.host == "127.0.0.1" ? "localhost" : options.server.host, server.port());
  std::fflush(stdout);
}

int ShowLive(const FoxgloveOptions& options, exports::FoxgloveServer* server) {
  const Attached attached = Attach(options.address);
  InstallStopSignals();
  Bus bus(attached.url);
  server->Start();
  exports::SceneSource scenes;
  std::string remark;
  size_t topics = 0;
  int64_t attempts = 0;
  exports::Encoder encoder(
      [&](const exports::Message& message) {
        if (encoder.topics().size() > topics) {
          server->SetTopics(encoder.topics());
          topics = encoder.topics().size();
        }
        // Messages of the previous episode are discarded when an episode begins.
        if (encoder.num_attempts() != attempts) server->Forget();
        attempts = encoder.num_attempts();
        server->Send(message);
        if (message.topic == exports::kTransforms) server->SendTime(message.time_ns);
      },
      [&](const model_info_t& model, std::optional<int64_t> seed) {
        return scenes.Of(model, seed, options.address.run);
      });
  server->SetTopics(encoder.topics());
  topics = encoder.topics().size();
  bus.SubscribeRaw("EVALBUS_.*", [&](std::string_view channel, std::span<const uint8_t> data, int64_t) {
    encoder.Receive(channel, data);
  });
  bus.SetMaxBatchDelay(kFrame);
  PrintAddress(*server, options, "listening to " + attached.url);
  while (!stop_requested()) {
    bus.Handle(steady_clock::now() + std::chrono::milliseconds(100));
    if (scenes.remark().empty() || scenes.remark() == remark) continue;
    remark = scenes.remark();
    fmt::print(stderr, "warning: {}\n", remark);
  }
  return 0;
}

// Queue of the viewers' playback requests, from the server's thread to the main thread.
class Controls {
 public:
  void Add(const exports::PlaybackControl& control) {
    const std::lock_guard lock(mutex_);
    // Dragging the seek bar sends many requests, of which only the last position matters.
    if (controls_.size() >= 100) controls_.pop_front();
    controls_.push_back(control);
  }
  std::deque<exports::PlaybackControl> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(controls_, {});
  }

 private:
  std::mutex mutex_;
  std::deque<exports::PlaybackControl> controls_;
};

int ShowRecording(const std::filesystem::path& log, const FoxgloveOptions& options) {
  InstallStopSignals();
  exports::SceneSource scenes;
  const exports::EncodedEpisode episode = exports::EncodeEpisode(log, &scenes);
  for (const std::string& remark : episode.remarks) fmt::print(stderr, "warning: {}\n", remark);
  const int64_t end = episode.messages.back().time_ns;
  Controls controls;
  exports::FoxgloveServer::Options server_options = options.server;
  server_options.playback_end_ns = end;
  server_options.on_control = [&](const exports::PlaybackControl& control) { controls.Add(control); };
  exports::FoxgloveServer server(server_options);
  server.Start();
  server.SetTopics(episode.topics);
  PrintAddress(server, options, "playing " + log.string());

  exports::Playback playback(end);
  size_t next = 0;
  const auto send_until = [&](int64_t time) {
    for (; next < episode.messages.size() && episode.messages[next].time_ns <= time; ++next) {
      server.Send(episode.messages[next]);
    }
    server.SendTime(time);
  };
  // Shows the state at a time, by sending the last message of each topic.
  const auto show = [&](int64_t time) {
    server.Forget();
    const auto behind = std::ranges::upper_bound(episode.messages, time, {}, &exports::Message::time_ns);
    next = static_cast<size_t>(behind - episode.messages.begin());
    std::set<size_t> shown;
    std::vector<size_t> last;
    for (size_t i = next; i-- > 0;) {
      if (shown.insert(episode.messages[i].topic).second) last.push_back(i);
    }
    for (size_t i = last.size(); i-- > 0;) server.Send(episode.messages[last[i]]);
    server.SendTime(time);
  };
  show(0);
  int viewers = 0;
  bool has_begun = false;
  exports::PlaybackStatus status = exports::PlaybackStatus::kPaused;
  while (!stop_requested()) {
    std::this_thread::sleep_for(kFrame);
    const auto now = steady_clock::now();
    std::deque<exports::PlaybackControl> pressed = controls.Take();
    // Playback begins when the first viewer connects.
    if (!std::exchange(has_begun, has_begun || server.viewers() > 0) && server.viewers() > 0) {
      pressed.push_front({.play = true, .speed = 1, .seek_ns = {}, .request_id = {}});
    }
    for (const exports::PlaybackControl& control : pressed) {
      const exports::PlaybackState state = playback.Control(control, now);
      server.SendPlayback(state);
      if (state.did_seek) show(state.time_ns);
      status = state.status;
    }
    const exports::PlaybackState state = playback.State(now);
    if (state.status == exports::PlaybackStatus::kPlaying || state.status != status)
      send_until(state.time_ns);
    if (state.status != status || server.viewers() != viewers) server.SendPlayback(state);
    status = state.status;
    viewers = server.viewers();
  }
  return 0;
}

// Returns the exit code. Throws InputError or EnvironmentError.
int Foxglove(const FoxgloveOptions& given) {
  FoxgloveOptions options = given;
  options.server.session = std::to_string(DrawId());
  auto reported = std::make_shared<std::set<std::string>>();
  options.server.on_refused = [reported](const std::string& text) {
    if (reported->size() < 20 && reported->insert(text).second) fmt::print(stderr, "{}\n", Printable(text));
  };
  const std::filesystem::path& run = options.address.run;
  const bool is_live = run.empty() || (options.episode.empty() && !LiveRunsOf(FindLiveRuns(), run).empty());
  if (!run.empty()) results::CheckHasEpisodes(run, options.episode);
  if (!is_live) return ShowRecording(results::EpisodeLogs(run, options.episode).front(), options);
  if (!options.episode.empty()) throw InputError("--episode requires the run's folder");
  exports::FoxgloveServer server(options.server);
  return ShowLive(options, &server);
}

}  // namespace

Action AddFoxgloveBridge(CLI::App* app) { return ActionOf<FoxgloveOptions>(app, AddOptions, Foxglove); }

}  // namespace evalbus::commands
