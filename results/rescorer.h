// Scores recorded episodes offline from their logs, without bus, clock or threads.
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
  // EPISODE_BEGIN; nullopt if evalbus did not simulate the episode.
  std::optional<episode_begin_t> begin;
  // Score computed from the log's STATE and CONTACTS.
  episode_summary_t summary{};
  // EPISODE_SUMMARY in the log; nullopt if there is none for this episode and attempt.
  std::optional<episode_summary_t> recorded;
  // False if the log has no EPISODE_END. The end is then taken from the recorded score or, without one, is
  // "aborted" at the last tick.
  bool has_end = false;

  bool equal() const;  // compares with the recorded score, by SameBits()
};

struct RescoredLog {
  std::vector<RescoredEpisode> episodes;
  // Number of damaged bytes that the log's reader skipped.
  int64_t damaged_bytes = 0;
  int64_t damaged_places = 0;
  // Number of intact events whose messages cannot be decoded.
  int64_t decode_errors = 0;
};

class Rescorer {
 public:
  // Without `task`, every episode is scored with the task description in its log, up to its recorded end, as
  // the metrics process did. With `task`, a lockstep episode ends where the sim would have ended it with this
  // description: at a failure, after_success_us after success, or at the time limit. If the log ends earlier,
  // the episode is not complete ("unconfirmed" or "aborted").
  explicit Rescorer(std::optional<TaskDescription> task = std::nullopt) : task_(std::move(task)) {}

  // Called when an episode begins.
  using BeginListener =
      std::function<void(const std::shared_ptr<const model_info_t>&, const episode_begin_t&)>;
  void OnBegin(BeginListener listener) { on_begin_ = std::move(listener); }
  // Called after each scored tick.
  using TickListener = std::function<void(const metrics::EpisodeScorer&, const state_t&, const contacts_t&)>;
  void OnTick(TickListener listener) { on_tick_ = std::move(listener); }

  // Throws InputError, with the file's name, if the file cannot be read, if its MODEL or task description is
  // invalid, or if it has no episode that this version can read because its messages have other types. A log
  // without MODEL or EPISODE_BEGIN has no episodes.
  RescoredLog Rescore(const std::filesystem::path& file);

 private:
  void OnEvent(const LogEvent& event, RescoredLog* log);
  void Begin(const episode_begin_t& begin);
  // Returns true for messages of the current episode and attempt.
  bool IsOurs(const header_t& header) const {
    return header.episode == begin_.header.episode && header.attempt == begin_.header.attempt;
  }
  template <class Message>
  void OnTickMessage(const LogEvent& event, Message* message, RescoredLog* log);
  void ScoreTicks();
  // Returns true if the first success is at least after_success_us before this tick.
  bool IsAfterSuccess(const header_t& header) const {
    return HasHeld(*model_, scorer_->verdict_time_us().value_or(0), header.sim_time_us);
  }
  // Ends the current episode, if there is one.
  void Finish(const std::optional<episode_summary_t>& recorded, RescoredLog* log);

  std::optional<TaskDescription> task_;
  BeginListener on_begin_;
  TickListener on_tick_;
  // Latest MODEL. The current episode keeps the MODEL with which it began.
  std::vector<uint8_t> model_bytes_;
  std::shared_ptr<const model_info_t> next_model_;
  std::shared_ptr<const model_info_t> model_;
  // Kept for the next log, because all episodes of a run have the same model. scorer_bytes_ is the encoded
  // model of scorer_.
  std::unique_ptr<metrics::EpisodeScorer> scorer_;
  std::vector<uint8_t> scorer_bytes_;
  metrics::TickMerger merger_;
  ConflictDetector conflicts_;
  state_t state_{};
  contacts_t contacts_{};

  // Channel of a message whose type is not the type that this version expects; empty if there was no such
  // message.
  std::string other_type_;
  bool running_ = false;
  episode_begin_t begin_{};
  // Header of the latest tick.
  header_t last_{};
  // end_: the end recorded in the log. own_end_: the end determined with task_.
  std::optional<episode_end_t> end_;
  std::optional<episode_end_t> own_end_;
};

// Text of a value that is absent.
inline constexpr char kAbsent[] = "none";
// A value that differs: its name as in episodes.jsonl (for example "metrics.slip_count") and both values as
// text, or kAbsent.
struct Difference {
  std::string name, before, after;
};
std::vector<Difference> Differences(const episode_summary_t& before, const episode_summary_t& after);
// Returns the differences between two JSON objects, for example two lines of episodes.jsonl.
std::vector<Difference> Differences(const nlohmann::ordered_json& before,
                                    const nlohmann::ordered_json& after);

// Returns a description of the first differences, for example "metrics.slip_count 0 -> 1, metrics.success 1
// -> 0 and 3 more".
std::string DifferencesText(const std::vector<Difference>& differences);

// Returns true if all fields are equal, floating-point numbers bit by bit.
bool SameBits(const episode_summary_t& a, const episode_summary_t& b);

// Returns "equal to the recorded score" or "no score was recorded", or describes the differences.
std::string DescribeDifference(const std::optional<episode_summary_t>& recorded,
                               const episode_summary_t& score);

}  // namespace evalbus::results
