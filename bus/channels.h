// The one table of channels. Each run has its own multicast port, so runs never hear each other.
#pragma once

#include <array>
#include <string_view>

namespace evalbus::channels {

inline constexpr char kModel[] = "EVALBUS_MODEL";
inline constexpr char kEpisodeBegin[] = "EVALBUS_EPISODE_BEGIN";
inline constexpr char kEpisodeEnd[] = "EVALBUS_EPISODE_END";
inline constexpr char kState[] = "EVALBUS_STATE";
inline constexpr char kContacts[] = "EVALBUS_CONTACTS";
inline constexpr char kObservation[] = "EVALBUS_OBSERVATION";
inline constexpr char kAction[] = "EVALBUS_ACTION";
inline constexpr char kPartial[] = "EVALBUS_PARTIAL";
inline constexpr char kEpisodeSummary[] = "EVALBUS_EPISODE_SUMMARY";
inline constexpr char kRunSummary[] = "EVALBUS_RUN_SUMMARY";
inline constexpr char kImagePrefix[] = "EVALBUS_IMAGE_";
inline constexpr char kStatus[] = "EVALBUS_STATUS";
inline constexpr char kCommand[] = "EVALBUS_COMMAND";

// Channels whose messages begin with a header_t.
inline constexpr std::array<std::string_view, 8> kWithHeader = {
    kEpisodeBegin, kEpisodeEnd, kState, kContacts, kObservation, kAction, kPartial, kEpisodeSummary};

}  // namespace evalbus::channels
