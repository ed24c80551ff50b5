#include "results/log_check.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "lcmtypes/clock.h"
#include "results/episode_json.h"
#include "results/rescorer.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Returns the differences between a line of episodes.jsonl and a score. Ignores keys that only the line or
// only the score has, such as keys of another version of evalbus and the pacing of a real-time run.
std::vector<Difference> DifferentValues(const ordered_json& line, const ordered_json& score) {
  // The score is written and parsed again, because text that is not valid UTF-8 changes when it is written.
  std::vector<Difference> differences = Differences(line, ordered_json::parse(ToText(score)));
  std::erase_if(differences,
                [](const Difference& one) { return one.before == kAbsent || one.after == kAbsent; });
  return differences;
}

// Compares numbers with a tolerance, because rates are rounded differently in run.json and MODEL.
bool IsEqual(const ordered_json& recorded, const ordered_json& found) {
  if (!recorded.is_number() || !found.is_number()) return recorded == found;
  return std::abs(recorded.get<double>() - found.get<double>()) <= 1e-9 * std::abs(found.get<double>());
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

std::vector<std::string> ModelDifferences(const RecordedRun& run, const model_info_t& model) {
  ordered_json found = {
      {"task", model.task},
      {"variation", model.variation},
      {"task_sha256", Sha256Text(model.task_yaml)},
      {"physics_sha256", model.physics_sha256},
      {"visual_sha256", model.visual_sha256},
      {"limits_sha256",
       model.limits_yaml.empty() ? ordered_json() : ordered_json(Sha256Text(model.limits_yaml))}};
  if (run.is_simulated()) {
    found["control_hz"] = 1 / ControlPeriod(model);
    found["realtime"] = model.clock == clock_name::kRealtime;
    if (run.info.value("realtime", false)) found["rtf"] = model.realtime_factor;
  }
  std::vector<std::string> differences;
  for (const auto& [key, value] : found.items()) {
    const auto recorded = run.info.find(key);
    if (recorded == run.info.end() || IsEqual(*recorded, value)) continue;
    differences.push_back(fmt::format("{} is {}, MODEL has {}", key, ToText(*recorded), ToText(value)));
  }
  // MODEL rounds the time that an episode continues after success up to a whole tick.
  const double after_success_s = run.info.value("after_success_s", 0.0);
  const double rounded_up_s = Seconds(model.after_success_us) - after_success_s;
  if (run.is_simulated() && (rounded_up_s < -1e-6 || rounded_up_s > ControlPeriod(model)))
    differences.push_back(fmt::format("after_success_s is {:g}, MODEL has {:g}", after_success_s,
                                      Seconds(model.after_success_us)));
  return differences;
}

}  // namespace evalbus::results
