// What a Foxglove viewer and its server say to each other (subprotocol foxglove.sdk.v1, and what is the same
// in foxglove.websocket.v1), and a clock for playing what is on disk. Pure: bytes in, facts out, whatever the
// bytes are.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/tools/encoder.h"

namespace evalbus::tools {

// The first of those a client offers that we speak; empty: none. offered: header Sec-WebSocket-Protocol.
std::string ChooseSubprotocol(std::string_view offered);
// The older one has no player, and its clients break off at a message about one.
inline bool KnowsPlayback(std::string_view subprotocol) { return subprotocol == "foxglove.sdk.v1"; }

// Text messages of a client. What is not for us (a client's own channels, parameters) is empty.
struct ClientText {
  // Of a subscription: the client's number for it, and the channel.
  std::vector<std::pair<uint32_t, uint32_t>> subscribe;
  std::vector<uint32_t> unsubscribe;
};
// Nothing: not a message of this protocol.
std::optional<ClientText> ParseClientText(std::string_view text);

struct PlaybackControl {
  bool play = false;
  // Above 0.
  float speed = 1;
  std::optional<uint64_t> seek_ns;
  std::string request_id;
};
// A binary message of a client; nothing: not one of these.
std::optional<PlaybackControl> ParsePlaybackControl(std::string_view bytes);

// What a server says, as text...
std::string ServerInfoText(const std::string& name, const std::string& session,
                           std::optional<int64_t> playback_end_ns);
std::string AdvertiseText(const std::vector<Topic>& topics, size_t from);
std::string UnadvertiseText(const std::vector<size_t>& channels);
std::string WarningText(const std::string& id, const std::string& message);
// ... and in binary.
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

// Where a player is: from 0 to end_ns.
class Playback {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr float kSlowest = 0.01F, kFastest = 100;

  explicit Playback(int64_t end_ns) : end_ns_(end_ns) {}

  // The state that answers it. A seek behind the end goes to the end; playing on from there begins anew.
  PlaybackState Control(const PlaybackControl& control, Time now);
  PlaybackState State(Time now) const;

 private:
  int64_t end_ns_;
  bool is_playing_ = false;
  float speed_ = 1;
  // Where it was when.
  int64_t from_ns_ = 0;
  Time since_{};
};

}  // namespace evalbus::tools
