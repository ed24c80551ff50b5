#include "export/foxglove_protocol.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_file.h"

namespace evalbus::exports {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr size_t kMaxSubscriptions = 1000;

template <class T>
void Put(T value, std::string* bytes) {
  for (size_t i = 0; i < sizeof(T); ++i) *bytes += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i));
}

// Removes a little-endian number from the front of `bytes`; returns false if there are too few bytes.
template <class T>
bool Take(std::string_view* bytes, T* value) {
  if (bytes->size() < sizeof(T)) return false;
  *value = 0;
  for (size_t i = 0; i < sizeof(T); ++i) {
    *value = static_cast<T>(*value | static_cast<T>(T{static_cast<uint8_t>((*bytes)[i])} << (8 * i)));
  }
  bytes->remove_prefix(sizeof(T));
  return true;
}

std::optional<uint32_t> Id(const nlohmann::json& value) {
  if (!value.is_number_unsigned() || value.get<uint64_t>() > std::numeric_limits<uint32_t>::max()) return {};
  return value.get<uint32_t>();
}

}  // namespace

std::string ChooseSubprotocol(std::string_view offered) {
  while (!offered.empty()) {
    const size_t comma = std::min(offered.find(','), offered.size());
    std::string_view one = offered.substr(0, comma);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    if (std::ranges::find(kSubprotocols, one) != std::end(kSubprotocols)) return std::string(one);
    offered.remove_prefix(std::min(comma + 1, offered.size()));
  }
  return "";
}

std::optional<ClientText> ParseClientText(std::string_view text) {
  nlohmann::json json;
  try {
    json = ParseJson(std::string(text), "a viewer's message");
  } catch (const InputError&) {
    return {};
  }
  if (!json.is_object() || !json.contains("op") || !json["op"].is_string()) return {};
  ClientText client;
  if (json["op"] == "subscribe") {
    const auto list = json.find("subscriptions");
    if (list == json.end() || !list->is_array() || list->size() > kMaxSubscriptions) return {};
    for (const auto& entry : *list) {
      if (!entry.is_object() || !entry.contains("id") || !entry.contains("channelId")) return {};
      const auto id = Id(entry["id"]), channel = Id(entry["channelId"]);
      if (!id || !channel) return {};
      client.subscribe.emplace_back(*id, *channel);
    }
  } else if (json["op"] == "unsubscribe") {
    const auto list = json.find("subscriptionIds");
    if (list == json.end() || !list->is_array() || list->size() > kMaxSubscriptions) return {};
    for (const auto& entry : *list) {
      const auto id = Id(entry);
      if (!id) return {};
      client.unsubscribe.push_back(*id);
    }
  }
  return client;
}

std::optional<PlaybackControl> ParsePlaybackControl(std::string_view bytes) {
  uint8_t op = 0, command = 0, has_seek = 0;
  uint32_t speed = 0, length = 0;
  uint64_t seek = 0;
  if (!Take(&bytes, &op) || op != 0x03 || !Take(&bytes, &command) || command > 1 || !Take(&bytes, &speed) ||
      !Take(&bytes, &has_seek) || has_seek > 1 || !Take(&bytes, &seek) || !Take(&bytes, &length) ||
      bytes.size() != length) {
    return {};
  }
  PlaybackControl control;
  control.play = command == 0;
  control.speed = std::bit_cast<float>(speed);
  if (!(control.speed > 0) || !std::isfinite(control.speed)) return {};
  if (has_seek == 1) control.seek_ns = seek;
  control.request_id = bytes;
  return control;
}

std::string ServerInfoText(const std::string& name, const std::string& session,
                           std::optional<int64_t> playback_end_ns) {
  Json json = {{"op", "serverInfo"},         {"name", name},
               {"capabilities", {"time"}},   {"supportedEncodings", {"json"}},
               {"metadata", Json::object()}, {"sessionId", session}};
  if (playback_end_ns) {
    json["capabilities"].push_back("playbackControl");
    json["dataStartTime"] = TimeJson(0);
    json["dataEndTime"] = TimeJson(*playback_end_ns);
  }
  return ToText(json);
}

std::string AdvertiseText(const std::vector<Topic>& topics, size_t from) {
  Json channels = Json::array();
  for (size_t id = from; id < topics.size(); ++id) {
    channels.push_back({{"id", id},
                        {"topic", topics[id].name},
                        {"encoding", "json"},
                        {"schemaName", topics[id].schema_name},
                        {"schemaEncoding", "jsonschema"},
                        {"schema", topics[id].schema}});
  }
  return ToText(Json{{"op", "advertise"}, {"channels", channels}});
}

std::string UnadvertiseText(const std::vector<size_t>& channels) {
  return ToText(Json{{"op", "unadvertise"}, {"channelIds", channels}});
}

std::string WarningText(const std::string& id, const std::string& message) {
  return ToText(Json{{"op", "status"}, {"level", 1}, {"message", message}, {"id", id}});
}

std::string MessageBytes(uint32_t subscription, int64_t time_ns, std::string_view json) {
  std::string bytes(1, '\x01');
  bytes.reserve(13 + json.size());
  Put(subscription, &bytes);
  Put(time_ns, &bytes);
  bytes += json;
  return bytes;
}

std::string TimeBytes(int64_t time_ns) {
  std::string bytes(1, '\x02');
  Put(time_ns, &bytes);
  return bytes;
}

std::string PlaybackStateBytes(const PlaybackState& state) {
  std::string bytes(1, '\x05');
  Put(static_cast<uint8_t>(state.status), &bytes);
  Put(state.time_ns, &bytes);
  Put(std::bit_cast<uint32_t>(state.speed), &bytes);
  Put(static_cast<uint8_t>(state.did_seek), &bytes);
  Put(static_cast<uint32_t>(state.request_id.size()), &bytes);
  return bytes + state.request_id;
}

PlaybackState Playback::State(Time now) const {
  PlaybackState state;
  state.time_ns = from_ns_;
  state.speed = speed_;
  if (is_playing_) {
    const auto passed = std::chrono::duration<double, std::nano>(now - since_).count() * speed_;
    state.time_ns =
        passed < static_cast<double>(end_ns_ - from_ns_) ? from_ns_ + std::llround(passed) : end_ns_;
    state.status = state.time_ns < end_ns_ ? PlaybackStatus::kPlaying : PlaybackStatus::kEnded;
  }
  return state;
}

PlaybackState Playback::Control(const PlaybackControl& control, Time now) {
  const PlaybackState before = State(now);
  from_ns_ = before.time_ns;
  bool did_seek = control.seek_ns.has_value();
  if (did_seek) {
    from_ns_ = static_cast<int64_t>(std::min(*control.seek_ns, static_cast<uint64_t>(end_ns_)));
  } else if (control.play && before.time_ns == end_ns_) {
    from_ns_ = 0;
    did_seek = true;
  }
  speed_ = std::clamp(control.speed, kSlowest, kFastest);
  is_playing_ = control.play;
  since_ = now;
  PlaybackState state = State(now);
  state.did_seek = did_seek;
  state.request_id = control.request_id;
  return state;
}

}  // namespace evalbus::exports
