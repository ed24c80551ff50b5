// Reads the episodes of a log for videos.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bus/event_log.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"

namespace evalbus::viz {

// If a log is truncated or damaged, the beginning of an episode may be missing.
struct RecordedEpisode {
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  // Sorted by time.
  std::vector<state_t> states;
  std::vector<partial_metrics_t> partials;
  std::vector<contacts_t> contacts;
  std::optional<episode_end_t> end;
  std::optional<episode_summary_t> summary;

  int number() const { return states.empty() ? begin->header.episode : states[0].header.episode; }
  // Returns the outcome as shown in tables if the episode has been scored, else the reason why it ended;
  // empty if the end is missing.
  std::string outcome() const;
};

// Reads the episodes of a log one after the other.
class EpisodeReader {
 public:
  // Throws InputError if the log cannot be read.
  explicit EpisodeReader(const std::filesystem::path& log) : reader_(log) {}

  // Returns false at the end of the log. For an episode that is not wanted, states, scores and contacts are
  // discarded.
  bool Next(
      RecordedEpisode* episode, const std::function<bool(int)>& is_wanted = [](int) { return true; });

  const EventLogReader& log() const { return reader_; }
  bool has_model() const { return model_.has_value(); }

 private:
  void AddState(RecordedEpisode* episode);

  EventLogReader reader_;
  LogEvent event_;
  state_t state_{};
  std::optional<model_info_t> model_;
  std::optional<episode_begin_t> next_begin_;
};

// Returns the numbers of the episodes from which a video can be made, in the log's order. Prints warnings
// about damage to standard error. Throws InputError for a log without MODEL or STATE.
std::vector<int> EpisodesOf(const std::filesystem::path& log);

// Throws InputError, with the available numbers, if a wanted episode is not in the log.
void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted);

// Loads the visual model from the run folder that contains the log, even if the folder has been moved since.
// For a log outside of a run folder, loads the file that MODEL names. Throws InputError.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log);

}  // namespace evalbus::viz
