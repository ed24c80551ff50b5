// What videos need of the episodes of a log.
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

// Of a log that was cut or damaged, the beginning may be missing.
struct RecordedEpisode {
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  // In order of time.
  std::vector<state_t> states;
  std::vector<partial_metrics_t> partials;
  std::vector<contacts_t> contacts;
  std::optional<episode_end_t> end;
  std::optional<episode_summary_t> summary;

  int number() const { return states.empty() ? begin->header.episode : states[0].header.episode; }
  // How it came out, in the tables' word, once it is scored; until then what ended it; empty without an end.
  std::string outcome() const;
};

// The episodes of a log, one after the other.
class EpisodeReader {
 public:
  // Throws InputError if the log cannot be read.
  explicit EpisodeReader(const std::filesystem::path& log) : reader_(log) {}

  // False where there is none any more. Of an episode that is not wanted no states, scores and contacts are
  // kept.
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

// The numbers of the episodes that can be recorded as video, in the log's order. Warns of damage on standard
// error. Throws InputError for a log without MODEL or STATE.
std::vector<int> EpisodesOf(const std::filesystem::path& log);

// Throws InputError, with those there are, for one that is wanted and is none of the log's.
void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted);

// The model of the run folder that the log is in, wherever the log says that it was; for a log alone, that.
// Throws InputError.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log);

}  // namespace evalbus::viz
