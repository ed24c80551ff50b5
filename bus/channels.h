// The table of all channels. It defines the message type of each channel, its publisher, and how the recorder
// handles it. docs/messages.md documents the same table. Each run has its own multicast port, so runs do not
// receive each other's messages.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "bus/message.h"
#include "evalbus/action_t.hpp"
#include "evalbus/command_t.hpp"
#include "evalbus/component_status_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/criteria_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/image_request_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/log_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/observation_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/policy_action_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/source_announcement_t.hpp"
#include "evalbus/source_contacts_t.hpp"
#include "evalbus/source_state_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus {

inline constexpr std::string_view kEverybody = "every component";
// External process that `evalbus watch` evaluates. It does not know the run's session.
inline constexpr std::string_view kSource = "source";

enum class Recorded {
  kYes,
  // Published once per tick or episode. A message that repeats the previous message on its channel is not
  // recorded.
  kOncePerTick,
  kOncePerEpisode,
  // Not recorded, because the messages differ between identical runs, or follow from recorded messages.
  kNo,
};

template <class Message>
struct Channel {
  const char* name;
  // Component that publishes on this channel, or kEverybody.
  std::string_view from;
  Recorded recorded = Recorded::kYes;

  constexpr operator std::string_view() const { return name; }
  friend bool operator==(const Channel& channel, std::string_view other) { return channel.name == other; }
};

namespace channels {

inline constexpr Channel<model_info_t> kModel{"EVALBUS_MODEL", "sim"};
inline constexpr Channel<episode_begin_t> kEpisodeBegin{"EVALBUS_EPISODE_BEGIN", "sim",
                                                        Recorded::kOncePerEpisode};
inline constexpr Channel<episode_end_t> kEpisodeEnd{"EVALBUS_EPISODE_END", "sim", Recorded::kOncePerEpisode};
inline constexpr Channel<state_t> kState{"EVALBUS_STATE", "sim", Recorded::kOncePerTick};
inline constexpr Channel<contacts_t> kContacts{"EVALBUS_CONTACTS", "collision", Recorded::kOncePerTick};
// Contacts of a source at a tick. The collision component converts them to CONTACTS (`evalbus watch
// --contacts source`).
inline constexpr Channel<contacts_t> kMeasuredContacts{"EVALBUS_MEASURED_CONTACTS", "sim", Recorded::kNo};
inline constexpr Channel<action_t> kAction{"EVALBUS_ACTION", "policy", Recorded::kOncePerTick};
inline constexpr Channel<image_request_t> kRequestImage{"EVALBUS_REQUEST_IMAGE", "policy", Recorded::kNo};
inline constexpr Channel<observation_t> kObservation{"EVALBUS_OBSERVATION", "policy"};
inline constexpr Channel<policy_action_t> kPolicyAction{"EVALBUS_POLICY_ACTION", "policy"};
inline constexpr Channel<partial_metrics_t> kPartial{"EVALBUS_PARTIAL", "metrics", Recorded::kOncePerTick};
inline constexpr Channel<criteria_t> kCriteria{"EVALBUS_CRITERIA", "metrics", Recorded::kNo};
inline constexpr Channel<episode_summary_t> kEpisodeSummary{"EVALBUS_EPISODE_SUMMARY", "metrics",
                                                            Recorded::kOncePerEpisode};
inline constexpr Channel<run_summary_t> kRunSummary{"EVALBUS_RUN_SUMMARY", "metrics"};
inline constexpr Channel<component_status_t> kStatus{"EVALBUS_STATUS", kEverybody};
inline constexpr Channel<command_t> kCommand{"EVALBUS_COMMAND", "run"};
inline constexpr Channel<log_t> kLog{"EVALBUS_LOG", kEverybody, Recorded::kNo};
inline constexpr Channel<source_announcement_t> kSourceAnnouncement{"EVALBUS_SOURCE_ANNOUNCEMENT", kSource,
                                                                    Recorded::kNo};
inline constexpr Channel<source_state_t> kSourceState{"EVALBUS_SOURCE_STATE", kSource};
inline constexpr Channel<source_contacts_t> kSourceContacts{"EVALBUS_SOURCE_CONTACTS", kSource};
// Prefix of the channels with rendered images; each camera has its own channel.
inline constexpr Channel<image_t> kImage{"EVALBUS_IMAGE_", "viz", Recorded::kNo};
// Images of a source's own cameras. kSourceImage: as published by the source. kCameraImage: as republished by
// the sim after its checks, with the episode's header.
inline constexpr Channel<image_t> kSourceImage{"EVALBUS_SOURCE_IMAGE_", kSource, Recorded::kNo};
inline constexpr Channel<image_t> kCameraImage{"EVALBUS_CAMERA_", "sim"};

// All channels: first the channels with one message per tick, then all other channels.
inline constexpr std::tuple kAll{
    kState,        kContacts,       kAction,       kPartial,     kRequestImage,    kObservation,
    kPolicyAction, kModel,          kEpisodeBegin, kEpisodeEnd,  kEpisodeSummary,  kRunSummary,
    kStatus,       kCommand,        kLog,          kImage,       kCriteria,        kSourceAnnouncement,
    kSourceState,  kSourceContacts, kSourceImage,  kCameraImage, kMeasuredContacts};

template <class Function>
void ForEach(const Function& function) {
  std::apply([&](const auto&... channel) { (function(channel), ...); }, kAll);
}

// Returns the channel of a camera's images: "left/hand/wrist" -> "EVALBUS_IMAGE_left_hand_wrist".
inline std::string ImageChannel(std::string camera, const Channel<image_t>& channel = kImage) {
  std::ranges::replace(camera, '/', '_');
  return channel.name + std::move(camera);
}

// Returns true if `name` is the channel's name or, for a channel whose name ends with "_", begins with it.
template <class Message>
bool Carries(const Channel<Message>& channel, std::string_view name) {
  const std::string_view own = channel.name;
  return name == own || (own.ends_with('_') && name.starts_with(own));
}

// Decodes a message on one of these channels and passes it to `handler`. Returns false if it cannot be
// decoded, true for messages on other channels.
template <class Handler, class... Message>
bool Dispatch(std::string_view name, std::span<const uint8_t> data, const Handler& handler,
              const Channel<Message>&... channel) {
  bool good = true;
  const auto pass = [&]<class Known>(const Channel<Known>& known) {
    if (!Carries(known, name)) return false;
    Known message{};
    good = Decode(data, &message);
    if (good) handler(std::move(message));
    return true;
  };
  (pass(channel) || ...);
  return good;
}

// Returns whether messages on this channel contain a session. False for channels of a source and for channels
// that are not in the table.
inline bool CarriesSession(std::string_view name) {
  bool carries = false;
  ForEach([&]<class Message>(const Channel<Message>& channel) {
    if (HasSession<Message> && channel.from != kSource && Carries(channel, name)) carries = true;
  });
  return carries;
}

// Returns how the recorder handles a channel with this name. Channels that are not in the table are recorded
// unchanged.
inline Recorded RecordedOf(std::string_view name) {
  Recorded recorded = Recorded::kYes;
  ForEach([&](const auto& channel) {
    if (Carries(channel, name)) recorded = channel.recorded;
  });
  return recorded;
}

// Removes duplicate types from a list.
template <class Once, class... Rest>
struct EachOnce {
  using Tuple = Once;
};
template <class... Once, class Message, class... Rest>
struct EachOnce<std::tuple<Once...>, Message, Rest...>
    : std::conditional_t<(std::is_same_v<Once, Message> || ...), EachOnce<std::tuple<Once...>, Rest...>,
                         EachOnce<std::tuple<Once..., Message>, Rest...>> {};

// Tuple type with one message object of each type. The objects are reused for decoding, so that they keep
// their storage.
template <class... Message>
typename EachOnce<std::tuple<>, Message...>::Tuple OneOfEach(const std::tuple<Channel<Message>...>&);
using Messages = decltype(OneOfEach(kAll));

// Returns false if `data` on a channel of the table is not a message of the channel's type. messages: scratch
// storage for decoding.
inline bool MatchesChannelType(std::string_view name, std::span<const uint8_t> data, Messages* messages) {
  bool good = true;
  ForEach([&]<class Message>(const Channel<Message>& channel) {
    if (Carries(channel, name)) good = Decode(data, &std::get<Message>(*messages));
  });
  return good;
}

// Returns the header of a message that belongs to a tick; nullopt for all other messages.
inline std::optional<header_t> TickOf(std::string_view name, std::span<const uint8_t> data) {
  std::optional<header_t> found;
  ForEach([&]<class Message>(const Channel<Message>& channel) {
    header_t header{};
    if constexpr (requires(Message message) { message.header; }) {
      if (channel.recorded == Recorded::kOncePerTick && channel == name &&
          DecodeHeader<Message>(data, &header) && IsPlausible(header)) {
        found = header;
      }
    }
  });
  return found;
}

}  // namespace channels
}  // namespace evalbus
