// Implements `evalbus rescore`, which scores recorded episodes again, offline.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "lcmtypes/end_reason.h"
#include "results/episode_json.h"
#include "results/episode_logs.h"
#include "results/kept_results.h"
#include "results/rescorer.h"
#include "runner/run_controller.h"
#include "viz/watch/score_rows.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct RescoreOptions {
  std::filesystem::path recording;
  // File with a different task description; empty: the description in each log is used.
  std::filesystem::path task;
  // File for the scores, in the format of episodes.jsonl; empty: no file is written.
  std::filesystem::path out;
};

// Maximum number of names in a list. The file --out contains all values.
constexpr size_t kNamesShown = 4;

TaskDescription ReadTask(const fs::path& file) {
  // Only the conditions of the description are used. The scene is taken from the log.
  return ParseTask(ReadInput(file, "task description"), file, false);
}

// Returns a text that states why the episode is incomplete; empty if it is complete.
std::string Missing(const results::RescoredEpisode& episode) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  const extended_metrics_t& extended = episode.summary.extended;
  if (extended.missing_ticks > 0) {
    add(fmt::format("{} missing", Plural(extended.missing_ticks, "tick")));
  }
  if (extended.refused_samples > 0) add(Plural(extended.refused_samples, "sample") + " refused");
  if (!episode.has_end) add("no EPISODE_END in the log");
  return text;
}

std::string Damage(const results::RescoredLog& log) {
  std::string text;
  if (log.damaged_bytes > 0) {
    text =
        fmt::format("{} damaged bytes in {} skipped", log.damaged_bytes, Plural(log.damaged_places, "place"));
  }
  if (log.decode_errors > 0) {
    text += fmt::format("{}{} could not be decoded", text.empty() ? "" : ", ",
                        Plural(log.decode_errors, "message"));
  }
  return text;
}

std::string Outcome(const episode_summary_t& summary) { return end_reason::Outcome(summary.failure_reason); }

std::string Arrow(const std::string& before, const std::string& after) {
  return before == after ? after : before + " -> " + after;
}

// Lists the metrics that changed, by the first part of their names, in the order of episodes.jsonl. Omits the
// explanation, the cause and the names of stages.
std::string ChangedMetrics(const std::vector<results::Difference>& differences) {
  std::vector<std::string> names;
  for (const results::Difference& difference : differences) {
    const size_t from = difference.name.find('.') + 1;  // after "metrics." or "extended."
    if (from == 0 || difference.name.starts_with("explanation.") || difference.name.starts_with("cause.") ||
        difference.name.starts_with("stage_names."))
      continue;
    const std::string name = difference.name.substr(from, difference.name.find('.', from) - from);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  if (names.empty()) return "nothing";
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), kNamesShown); ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kNamesShown) text += fmt::format(" and {} more", names.size() - kNamesShown);
  return text;
}

void PrintScore(const results::RescoredEpisode& episode) {
  const episode_summary_t& summary = episode.summary;
  fmt::print("{:>7}  {:<24} {:>6.2f} s  {:>6}  {}\n", summary.header.episode, Outcome(summary),
             summary.metrics.completion_time_s, viz::StageCount(summary.metrics),
             results::DescribeDifference(episode.recorded, summary));
}

void PrintChanges(const results::RescoredEpisode& episode) {
  const episode_summary_t& after = episode.summary;
  const episode_summary_t& before = episode.recorded ? *episode.recorded : after;
  const auto time = [](const episode_summary_t& summary) {
    return fmt::format("{:.2f}", summary.metrics.completion_time_s);
  };
  fmt::print(
      "{:>7}  {:<28}  {:<14}  {:<10}  {}\n", after.header.episode, Arrow(Outcome(before), Outcome(after)),
      Arrow(time(before), time(after)),
      Arrow(viz::StageCount(before.metrics), viz::StageCount(after.metrics)),
      episode.recorded ? ChangedMetrics(results::Differences(before, after)) : "no score was recorded");
  if (Outcome(before) != Outcome(after)) fmt::print("         {}\n", after.explanation.text);
}

// Returns a summary such as "3 of 10 verdicts changed: success -> wrong_pose 2, timeout -> success 1".
std::string ChangedVerdicts(const std::map<std::string, int>& changes, int episodes) {
  int changed = 0;
  std::string list;
  for (const auto& [change, count] : changes) {
    changed += count;
    list += fmt::format("{}{} {}", list.empty() ? ": " : ", ", change, count);
  }
  return fmt::format("{} of {} verdicts changed{}", changed, episodes, list);
}

void AddOptions(CLI::App* app, RescoreOptions* options) {
  app->add_option("recording", options->recording, "folder of a run, a suite or an episode, or a log")
      ->required();
  app->add_option(
         "--task", options->task,
         "score with the conditions of this task description, a modified copy of the recorded task's file")
      ->type_name("YAML");
  app->add_option("--out", options->out, "write the scores to this file, in the format of episodes.jsonl")
      ->type_name("FILE");
}

// Returns 2 if a log of an episode in episodes.jsonl is missing. Without --task, also returns 2 if a score
// differs from the log or from episodes.jsonl, or if a log has no episode. Otherwise returns 0. Throws
// InputError or EnvironmentError.
int Rescore(const RescoreOptions& options) {
  const bool new_rules = !options.task.empty();
  results::Rescorer rescorer(new_rules ? std::optional(ReadTask(options.task)) : std::nullopt);
  const std::vector<fs::path> logs = results::EpisodeLogs(options.recording);
  if (!options.out.empty()) {
    if (fs::is_regular_file(options.out) || fs::is_directory(options.out))
      throw InputError("--out " + options.out.string() + ": exists; choose another name");
    if (!fs::is_directory(fs::absolute(options.out).parent_path())) {
      throw InputError("--out " + options.out.string() +
                       ": no such folder: " + fs::absolute(options.out).parent_path().string());
    }
  }
  std::string lines;
  results::KeptResults kept(options.recording);

  int episodes = 0, equal = 0, kept_otherwise = 0, complete = 0, logs_without = 0;
  int successes = 0, recorded_successes = 0;
  std::map<std::string, int> changes;
  fs::path run;                    // run of the previous log
  double simulated = 0, wall = 0;  // s
  for (const fs::path& file : logs) {
    const auto started = std::chrono::steady_clock::now();
    const results::RescoredLog log = rescorer.Rescore(file);
    wall += std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    if (log.episodes.empty() && logs.size() == 1) {
      throw InputError(file.string() + ": no episode in this log (EVALBUS_MODEL and EVALBUS_EPISODE_BEGIN)");
    }
    if (RunFolderOf(file) != run && !log.episodes.empty()) {
      const model_info_t& model = *log.episodes[0].model;
      fmt::print("{}{}/{}  {}\n", run.empty() ? "" : "\n", model.task, model.variation,
                 new_rules ? "conditions of " + options.task.string() : "recorded conditions");
      fmt::print("{}\n", new_rules
                             ? "episode  verdict                       time, s         stages      changed"
                             : "episode  end                          time   stages  score");
      run = RunFolderOf(file);
    }
    for (const results::RescoredEpisode& episode : log.episodes) {
      new_rules ? PrintChanges(episode) : PrintScore(episode);
      if (const std::string missing = Missing(episode); !missing.empty()) {
        fmt::print("         incomplete: {}\n", missing);
      }
      const std::string difference = kept.Difference(file, episode);
      if (!new_rules && !difference.empty()) {
        ++kept_otherwise;
        fmt::print("         {}\n", difference);
      }
      if (!options.out.empty()) {
        const model_info_t& model = *episode.model;
        lines += ToText(results::EpisodeJson(model.task, model.variation, episode.summary,
                                             episode.begin ? &*episode.begin : nullptr)) +
                 "\n";
      }
      ++episodes;
      equal += episode.equal();
      complete += episode.summary.complete;
      successes += episode.summary.complete && episode.summary.metrics.success;
      recorded_successes +=
          episode.recorded && episode.recorded->complete && episode.recorded->metrics.success;
      if (episode.recorded && Outcome(*episode.recorded) != Outcome(episode.summary)) {
        ++changes[Arrow(Outcome(*episode.recorded), Outcome(episode.summary))];
      }
      simulated += static_cast<double>(episode.summary.header.sim_time_us) * 1e-6;
    }
    if (log.episodes.empty()) {
      ++logs_without;
      fmt::print("      -  {}: nothing to score: MODEL or EPISODE_BEGIN is missing\n", file.string());
    }
    if (const std::string damage = Damage(log); !damage.empty()) {
      fmt::print("         {}: {}\n", file.string(), damage);
    }
  }
  const std::vector<fs::path> gone = kept.Missing();
  for (const fs::path& log : gone)
    fmt::print("      -  {}: this log is missing; episodes.jsonl has its score\n", log.string());
  if (!options.out.empty()) WriteWhole(options.out, lines);
  if (new_rules) {
    fmt::print("\n{}\n", ChangedVerdicts(changes, episodes));
    fmt::print("{} episodes, {} complete; successes {} -> {}", episodes, complete, recorded_successes,
               successes);
  } else {
    fmt::print("\n{} of {} episodes have scores bit-identical to the recorded ones", equal, episodes);
  }
  fmt::print("; {:.1f} s simulated in {:.3f} s, {:.0f} x real time\n", simulated, wall, simulated / wall);
  if (kept_otherwise > 0) {
    fmt::print("{} of {} episodes differ between episodes.jsonl and their logs\n", kept_otherwise, episodes);
  }
  if (!gone.empty()) fmt::print("{} of {} logs are missing\n", gone.size(), logs.size() + gone.size());
  const bool as_kept = equal == episodes && logs_without == 0 && kept_otherwise == 0;
  return gone.empty() && (new_rules || as_kept) ? 0 : 2;
}

}  // namespace

Action AddRescore(CLI::App* app) { return ActionOf<RescoreOptions>(app, AddOptions, Rescore); }

}  // namespace evalbus::commands
