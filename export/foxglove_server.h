// A WebSocket server for Foxglove: https://docs.foxglove.dev/docs/connecting-to-data/live-data. It runs on
// its own thread, so it never delays its caller. Viewers do not delay each other, because slow viewers lose
// the oldest messages and receive a warning.
//
// If the server listens on a loopback address, the request's Host must be a loopback name. Requests from web
// pages are accepted only from Foxglove's own web application, from this server's own origin, or from
// Options::origins.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "export/encoder.h"
#include "export/foxglove_protocol.h"

namespace evalbus::exports {

class FoxgloveServer {
 public:
  // Maximum size and number of the messages that are queued for one viewer.
  static constexpr size_t kQueueBytes = size_t{32} << 20, kQueueMessages = 2000;
  static constexpr int kViewers = 50;

  struct Options {
    std::string host = "127.0.0.1";
    // Port to listen on; 0: any free port.
    uint16_t port = 8765;
    std::vector<std::string> origins;
    // Name that the viewer displays.
    std::string name = "evalbus";
    std::string session;
    // Length of a recording that is played; viewers then show playback controls.
    std::optional<int64_t> playback_end_ns;
    // Called on the server's thread when a viewer uses its playback controls.
    std::function<void(const PlaybackControl&)> on_control = {};
    // Called on the server's thread, with one sentence for users, when a request is rejected because of its
    // origin.
    std::function<void(const std::string&)> on_refused = {};
  };

  // Opens the port in the current network namespace; does not start the thread. Throws InputError if the host
  // is not an IP address of this machine or the port is in use.
  explicit FoxgloveServer(const Options& options);
  ~FoxgloveServer();
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  // Starts the thread, which serves until this object is destroyed. Messages sent earlier are kept.
  void Start();

  uint16_t port() const;
  int viewers() const;

  // Sets the topics (Encoder::topics()). The list must only grow.
  void SetTopics(const std::vector<Topic>& topics);
  // Sends a message. The last message of each topic is kept and sent to later subscribers.
  void Send(const Message& message);
  // Discards the kept messages. Must be called before another episode and after a seek.
  void Forget();
  void SendTime(int64_t time_ns);
  void SendPlayback(const PlaybackState& state);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace evalbus::exports
