#include "results/log_check.h"

#include <fmt/format.h>

#include <optional>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "results/episode_json.h"
#include "results/model_of_run.h"
#include "results/rescorer.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Returns the differences between a line of episodes.jsonl and a score. Ignores keys that only one of them
// has, such as keys of another version of evalbus and the pacing of a realtime run.
std::vector<Difference> DifferentValues(const ordered_json& line, const ordered_json& score) {
  // The score is written and parsed again, because text that is not valid UTF-8 changes when it is written.
  std::vector<Difference> differences = Differences(line, ordered_json::parse(ToText(score)));
  std::erase_if(differences,
                [](const Difference& one) { return one.before == kAbsent || one.after == kAbsent; });
  return differences;
}

}  // namespace

model_info_t CheckLog(const RecordedRun& run, const RecordedEpisode& episode) {
  const std::filesystem::path log = EpisodeLog(run.folder, episode.episode);
  const auto fail = [&](const std::string& what) { throw InputError(log.string() + ": " + what); };
  EventLogReader reader(log);
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  std::optional<episode_summary_t> summary;
  int64_t events = 0;
  for (LogEvent event; reader.Next(&event); ++events) {
    // The recorder numbers events from 0.
    if (event.number != events && reader.damaged_places() == 0) {
      fail(fmt::format("event {} is missing", events));
    }
    if (event.channel == channels::kModel) {
      if (model_info_t read; Decode(event.data, &read)) model = std::move(read);
    } else if (event.channel == channels::kEpisodeBegin) {
      episode_begin_t read;
      if (Decode(event.data, &read) && read.header.episode == episode.episode) begin = std::move(read);
    } else if (event.channel == channels::kEpisodeSummary) {
      episode_summary_t read;
      if (Decode(event.data, &read) && read.header.episode == episode.episode) summary = std::move(read);
    }
  }
  if (reader.damaged_places() > 0) {
    fail(fmt::format("damaged: {} bytes cannot be read", reader.damaged_bytes()));
  }
  if (!model) fail("no MODEL that this version of evalbus can read");
  if (!summary) {
    fail(fmt::format(
        "no EPISODE_SUMMARY of episode {}: the log is truncated, or was made by another version of evalbus",
        episode.episode));
  }
  if (const auto differences = ModelDifferences(run, *model); !differences.empty()) {
    fail(fmt::format("belongs to another run: {}: {}", (run.folder / kRunJson).string(), differences[0]));
  }
  const auto differences = DifferentValues(
      episode.Json(), EpisodeJson(run.task, run.variation, *summary, begin ? &*begin : nullptr));
  if (!differences.empty()) {
    fail(fmt::format("does not match line {} of {}: {}", episode.line, kEpisodesJsonl,
                     DifferencesText(differences)));
  }
  return *model;
}

}  // namespace evalbus::results
