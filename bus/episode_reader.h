// Reads the episodes of a log one at a time, as decoded messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"

namespace evalbus {

// Messages of one attempt at an episode. The lists are ordered by tick and hold each tick at most once. If
// the log is truncated or damaged, parts are missing.
struct EpisodeMessages {
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  std::vector<state_t> states;
  std::vector<contacts_t> contacts;
  std::vector<action_t> actions;
  std::vector<partial_metrics_t> partials;
  std::optional<episode_end_t> end;
  std::optional<episode_summary_t> summary;
  // Header of EPISODE_BEGIN or, if that is missing, of the first message of a tick.
  header_t first_header{};

  int32_t number() const { return first_header.episode; }
  // Returns the outcome as shown in tables if the episode has been scored, else the reason why it ended;
  // empty if the end is missing.
  std::string outcome() const;
};

// How repeated, late and damaged messages are treated:
// - An EPISODE_BEGIN with a different episode, attempt or seed, after EPISODE_END, or after ticks without an
//   EPISODE_BEGIN, begins the next EpisodeMessages. Otherwise it is a repetition, because the sim repeats it
//   until all components are ready.
// - Messages whose episode or attempt differs from EPISODE_BEGIN are ignored, because they are late messages
//   of an earlier attempt. Without EPISODE_BEGIN, the first message of a tick determines both.
// - If a channel has several messages for one tick, the first is used, because the sim repeats STATE until it
//   is answered. In a real-time run, messages may have been recorded out of order; they are sorted.
// - A STATE that is not later than the previous STATE, or more than 60 s later, is damaged and ignored.
// - The last MODEL before the first message of a tick is used or, if there is none, the first later one.
//   Other later ones are repetitions or belong to the next run.
// - Messages that cannot be decoded are ignored. log() counts the damage in the log.
// The caller decides which missing parts it accepts.
class EpisodeReader {
 public:
  using Channels = std::set<std::string_view>;
  static inline const Channels kAllChannels = {channels::kState, channels::kContacts, channels::kAction,
                                               channels::kPartial};

  // channels: the channels to decode, all by default; the lists of other channels remain empty. Throws
  // the errors of EventLogReader.
  explicit EpisodeReader(const std::filesystem::path& log, Channels channels = kAllChannels)
      : reader_(log), channels_(std::move(channels)) {}

  // Reads the next episode. Returns false at the end of the log. If is_wanted() returns false for the
  // episode's index, its lists remain empty. Throws InputError if the log has been truncated since it was
  // opened.
  bool Next(
      EpisodeMessages* episode, const std::function<bool(int)>& is_wanted = [](int) { return true; });

  const EventLogReader& log() const { return reader_; }
  bool has_model() const { return model_.has_value(); }

  // Returns why the log does not contain this whole episode, for example "damaged: 12 bytes cannot be read"
  // or "the end of the episode is missing (EPISODE_END, EPISODE_SUMMARY)"; empty if it does. Gaps between
  // ticks are not found. Must be called at the end of the log. episode: an episode that Next() returned, or
  // null.
  std::string WhyNotWhole(const EpisodeMessages* episode) const;

 private:
  template <class Message>
  void Add(const Channel<Message>& channel, const std::function<bool(int)>& is_wanted,
           std::vector<Message>* messages, EpisodeMessages* episode);

  EventLogReader reader_;
  Channels channels_;
  LogEvent event_;
  std::optional<model_info_t> model_;
  // EPISODE_BEGIN of the next episode.
  std::optional<episode_begin_t> next_begin_;
  // False until the first message of a tick of the current episode.
  bool has_tick_ = false;
};

}  // namespace evalbus
