// A WebSocket server for Foxglove: https://docs.foxglove.dev/docs/connecting-to-data/live-data. One thread of
// its own; nobody waits for it, and no viewer for another: who reads slowly loses the oldest messages, and is
// told so.
//
// Who may ask: on a loopback address whoever says a loopback name as Host. A browser's page only from
// Foxglove's own web application, from this server's own origin, or from an origin that was named.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/tools/encoder.h"
#include "cli/tools/foxglove_protocol.h"

namespace evalbus::tools {

class FoxgloveServer {
 public:
  // Of messages that wait for one viewer.
  static constexpr size_t kQueueBytes = size_t{32} << 20, kQueueMessages = 2000;
  static constexpr int kViewers = 50;

  struct Options {
    std::string host = "127.0.0.1";
    // 0: one that is free.
    uint16_t port = 8765;
    std::vector<std::string> origins;
    // Shown by the viewer.
    std::string name = "evalbus";
    std::string session;
    // Of what is on disk: viewers get a player's buttons.
    std::optional<int64_t> playback_end_ns;
    // A viewer pressed one; on the server's thread.
    std::function<void(const PlaybackControl&)> on_control = {};
    // A sentence about who was not let in; on the server's thread.
    std::function<void(const std::string&)> on_refused = {};
  };

  // Listens, in the network that this process is in now, and starts no thread yet. Throws InputError where
  // the address is none of this machine or its port is taken.
  explicit FoxgloveServer(const Options& options);
  ~FoxgloveServer();
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  // Serves, until it is destroyed. What was sent before is not lost.
  void Start();

  uint16_t port() const;
  int viewers() const;

  // Those of an encoder, which only grow.
  void SetTopics(const std::vector<Topic>& topics);
  // The last one of each topic is kept for who subscribes later.
  void Send(const Message& message);
  // Drops what is kept: another episode, or another time.
  void Forget();
  void SendTime(int64_t time_ns);
  void SendPlayback(const PlaybackState& state);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace evalbus::tools
