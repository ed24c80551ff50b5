// Parses and serializes the messages between a Foxglove viewer and its server (subprotocol foxglove.sdk.v1,
// and the parts that foxglove.websocket.v1 shares). Arbitrary input is safe. Also contains a clock for
// playback.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "export/encoder.h"

namespace evalbus::exports {

// Returns the first supported subprotocol that a client offers; empty if there is none. offered: value of the
// header Sec-WebSocket-Protocol.
std::string ChooseSubprotocol(std::string_view offered);
// Returns false for the older subprotocol, which has no playback; its clients disconnect if they receive a
// playback message.
inline bool SupportsPlayback(std::string_view subprotocol) { return subprotocol == "foxglove.sdk.v1"; }

// A client's text message. Unsupported requests (client channels, parameters) give an empty struct.
struct ClientText {
  // Pairs of the client's subscription id and the channel id.
  std::vector<std::pair<uint32_t, uint32_t>> subscribe;
  std::vector<uint32_t> unsubscribe;
};
// Returns nullopt if the text is not a message of this protocol.
std::optional<ClientText> ParseClientText(std::string_view text);

struct PlaybackControl {
  bool play = false;
  // Playback speed, greater than 0; 1 is real time.
  float speed = 1;
  std::optional<uint64_t> seek_ns;
  std::string request_id;
};
// Parses a client's binary playback request; nullopt for any other message.
std::optional<PlaybackControl> ParsePlaybackControl(std::string_view bytes);

// Return the server's text messages.
std::string ServerInfoText(const std::string& name, const std::string& session,
                           std::optional<int64_t> playback_end_ns);
std::string AdvertiseText(const std::vector<Topic>& topics, size_t from);
std::string UnadvertiseText(const std::vector<size_t>& channels);
std::string WarningText(const std::string& id, const std::string& message);
// Return the server's binary messages.
std::string MessageBytes(uint32_t subscription, int64_t time_ns, std::string_view json);
std::string TimeBytes(int64_t time_ns);

enum class PlaybackStatus : uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
struct PlaybackState {
  PlaybackStatus status = PlaybackStatus::kPaused;
  int64_t time_ns = 0;
  float speed = 1;
  bool did_seek = false;
  std::string request_id;
};
std::string PlaybackStateBytes(const PlaybackState& state);

// Clock of a playback, with positions from 0 to end_ns.
class Playback {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr float kSlowest = 0.01F, kFastest = 100;

  explicit Playback(int64_t end_ns) : end_ns_(end_ns) {}

  // Executes `control` and returns the new state as the answer. A seek beyond the end moves to the end.
  // Playback from the end restarts at the beginning.
  PlaybackState Control(const PlaybackControl& control, Time now);
  PlaybackState State(Time now) const;

 private:
  int64_t end_ns_;
  bool is_playing_ = false;
  float speed_ = 1;
  // The position was from_ns_ at the time since_.
  int64_t from_ns_ = 0;
  Time since_{};
};

}  // namespace evalbus::exports
