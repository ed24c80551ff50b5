// Scores recorded episodes from their logs, offline: no bus, no clock, no threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bus/conflict_detector.h"
#include "bus/event_log.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/clock.h"
#include "metrics/episode/episode_scorer.h"
#include "metrics/episode/tick_merger.h"

namespace evalbus::results {

struct RescoredEpisode {
  std::shared_ptr<const model_info_t> model;
  // EPISODE_BEGIN; nothing where evalbus did not simulate the episode.
  std::optional<episode_begin_t> begin;
  // Score from the log's STATE and CONTACTS.
  episode_summary_t summary{};
  // EPISODE_SUMMARY of the log, if it has one for this episode and attempt.
  std::optional<episode_summary_t> recorded;
  // False where EPISODE_END is not in the log: the end is then taken from the recorded score or, without one,
  // is "aborted" at the last tick there is.
  bool has_end = false;

  bool equal() const;  // to what was recorded, by SameBits
};

struct RescoredLog {
  std::vector<RescoredEpisode> episodes;
  // What the log's reader skipped.
  int64_t damaged_bytes = 0;
  int64_t damaged_places = 0;
  // Messages that are whole events but do not decode.
  int64_t decode_errors = 0;
};

class Rescorer {
 public:
  // Without a task, every episode is judged by the description in its log up to its recorded end, as the
  // metrics process did. With one, a lockstep episode ends where the sim would have ended it: at this
  // description's verdict, after_success_us later than its success, or at its time limit. Where the log ends
  // before that, it is not complete ("unconfirmed" or "aborted").
  explicit Rescorer(std::optional<TaskDescription> task = std::nullopt) : task_(std::move(task)) {}

  // Called when an episode begins.
  using BeginListener =
      std::function<void(const std::shared_ptr<const model_info_t>&, const episode_begin_t&)>;
  void OnBegin(BeginListener listener) { on_begin_ = std::move(listener); }
  // Called after each tick that was scored.
  using TickListener = std::function<void(const metrics::EpisodeScorer&, const state_t&, const contacts_t&)>;
  void OnTick(TickListener listener) { on_tick_ = std::move(listener); }

  // Throws InputError, with the file's name, if it cannot be read or its messages are not ours. A log without
  // MODEL or EPISODE_BEGIN has no episodes.
  RescoredLog Rescore(const std::filesystem::path& file);

 private:
  void OnEvent(const LogEvent& event, RescoredLog* log);
  void Begin(const episode_begin_t& begin);
  // Of the episode and attempt under way.
  bool IsOurs(const header_t& header) const {
    return header.episode == begin_.header.episode && header.attempt == begin_.header.attempt;
  }
  template <class Message>
  void OnTickMessage(const LogEvent& event, Message* message, RescoredLog* log);
  void ScoreTicks();
  // At this tick the first success is after_success_us ago.
  bool IsAfterSuccess(const header_t& header) const {
    return HasHeld(*model_, scorer_->verdict_time_us().value_or(0), header.sim_time_us);
  }
  // Ends the episode in progress, if there is one.
  void Finish(const std::optional<episode_summary_t>& recorded, RescoredLog* log);

  std::optional<TaskDescription> task_;
  BeginListener on_begin_;
  TickListener on_tick_;
  // MODEL as last heard; the episode under way goes on with the one that it began with.
  std::vector<uint8_t> model_bytes_;
  std::shared_ptr<const model_info_t> next_model_;
  std::shared_ptr<const model_info_t> model_;
  // Kept from log to log, since all episodes of a run have the same model: that of these bytes.
  std::unique_ptr<metrics::EpisodeScorer> scorer_;
  std::vector<uint8_t> scorer_bytes_;
  metrics::TickMerger merger_;
  ConflictDetector conflicts_;
  state_t state_{};
  contacts_t contacts_{};

  // Channel of a message of ours that is of another type than ours; empty if there was none.
  std::string other_type_;
  bool running_ = false;
  episode_begin_t begin_{};
  // Latest tick heard of.
  header_t last_{};
  // The end in the log, and the one that task_ brings.
  std::optional<episode_end_t> end_;
  std::optional<episode_end_t> own_end_;
};

// A value that differs: its name as in episodes.jsonl ("metrics.slip_count") and both values as text, "-"
// where absent.
struct Difference {
  std::string name, before, after;
};
std::vector<Difference> Differences(const episode_summary_t& before, const episode_summary_t& after);
// The same of two lines.
std::vector<Difference> Differences(const nlohmann::ordered_json& before,
                                    const nlohmann::ordered_json& after);

// The first of them: "metrics.slip_count 0 -> 1, metrics.success 1 -> 0 and 3 more".
std::string DifferencesText(const std::vector<Difference>& differences);

// Every field is equal, doubles by their bits.
bool SameBits(const episode_summary_t& a, const episode_summary_t& b);

// For people: "equal to the recorded score", or what differs.
std::string DescribeDifference(const std::optional<episode_summary_t>& recorded,
                               const episode_summary_t& score);

}  // namespace evalbus::results
