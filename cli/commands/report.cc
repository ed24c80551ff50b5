// evalbus report: writes a run, or a suite of runs, as one HTML page.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/plural.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "bus/recorder/recorder.h"
#include "cli/commands/commands.h"
#include "metrics/statistics/run_statistics.h"
#include "plans/plan_report.h"
#include "report/episode_trace.h"
#include "report/episode_tracks.h"
#include "report/page/report_page.h"
#include "report/page_links.h"
#include "report/viewer_pack.h"
#include "results/episode_logs.h"
#include "results/pacing.h"
#include "results/policy_calls.h"
#include "results/run_reader.h"
#include "runner/version.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  // Folder of a run, a suite or a plan.
  std::filesystem::path run;
  // Empty: report.html in that folder.
  std::filesystem::path out;
  // Episodes whose curves are drawn, and which can be played in 3D. Empty: curves of the first failures and
  // of the success with the median time; in 3D as many episodes as fit.
  std::vector<int> episodes;
  // Maximum size of the page with its viewer; 0: no viewer.
  double megabytes = report::kPageMegabytes;
};

constexpr size_t kFailuresDrawn = 2;
// The report of a suite shows one episode of each run, with its most informative figures only.
constexpr size_t kFiguresInSuite = 6;

struct Choice {
  int episode;
  std::string why;
};

// Returns the first failures and the success with the median time; for runs without a failure, also the
// slowest success.
std::vector<Choice> ChooseEpisodes(const results::RecordedRun& run, size_t failures) {
  std::vector<Choice> chosen;
  std::vector<std::pair<double, int>> successes;  // time, episode
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (!episode.complete) continue;
    if (episode.success) {
      successes.emplace_back(episode.completion_time, episode.episode);
    } else if (chosen.size() < failures) {
      chosen.push_back({episode.episode, chosen.empty() ? "first failure" : "next failure"});
    }
  }
  if (successes.empty()) return chosen;
  std::sort(successes.begin(), successes.end());
  const int median = successes[(successes.size() - 1) / 2].second, slowest = successes.back().second;
  const bool failed = !chosen.empty();
  chosen.push_back({median, "success with the median time"});
  if (!failed && slowest != median) chosen.push_back({slowest, "slowest success"});
  return chosen;
}

std::vector<report::ReportMetric> Metrics(const metrics::RunSummary& summary) {
  std::vector<report::ReportMetric> metrics;
  for (const metrics::MetricSummary& metric : summary.metrics) {
    metrics.push_back({.name = metric.name,
                       .statistics = {{"episodes", {static_cast<double>(metric.episodes)}},
                                      {"mean", {metric.mean}},
                                      {"mean_95", {metric.mean_95.lower, metric.mean_95.upper}},
                                      {"std", {metric.std}},
                                      {"median", {metric.median}},
                                      {"p5", {metric.p5}},
                                      {"p95", {metric.p95}},
                                      {"min", {metric.min}},
                                      {"max", {metric.max}}}});
  }
  return metrics;
}

report::ReportEpisode Episode(const results::RecordedEpisode& recorded) {
  report::ReportEpisode episode;
  episode.episode = recorded.episode;
  episode.seed = recorded.seed;
  episode.end_reason = recorded.end_reason;
  episode.failure_reason = recorded.failure_reason;
  episode.complete = recorded.complete;
  episode.success = recorded.success;
  episode.values = recorded.Values();
  episode.explanation = recorded.explanation;
  return episode;
}

std::vector<report::ReportStage> Stages(const metrics::RunSummary& summary) {
  std::vector<report::ReportStage> stages;
  for (const metrics::StageSummary& stage : summary.stages) {
    const std::string index = std::to_string(stage.index);
    const metrics::MetricSummary* time = summary.Find("extended.stage_time_s." + index);
    stages.push_back({index, "", stage.reached, time ? time->median : std::nan("")});
  }
  return stages;
}

void AddCurves(const results::RecordedRun& recorded, const std::vector<Choice>& choices, bool asked_for,
               report::ReportRun* run) {
  for (const Choice& choice : choices) {
    try {
      const auto track =
          report::TrackEpisode(results::EpisodeLogs(recorded.folder, {choice.episode}).front(), {});
      report::EpisodeTrace trace = report::Trace(*track);
      // These values are stored only in the logs.
      if (run->curves.empty()) {
        const metric_values_t& metrics = track->summary()->metrics;
        for (int k = 0; k < metrics.num_stages; ++k) {
          for (report::ReportStage& stage : run->stages) {
            if (stage.index == std::to_string(metrics.stage_index[k])) stage.name = metrics.stage_name[k];
          }
        }
        run->made.emplace_back("physics_sha256", track->model().physics_sha256);
        run->made.emplace_back("visual_sha256", track->model().visual_sha256);
      }
      run->curves.push_back({.episode = choice.episode,
                             .why = choice.why,
                             .figures = std::move(trace.figures),
                             .events = std::move(trace.events)});
    } catch (const InputError& error) {
      if (asked_for) throw;
      run->remarks.push_back(fmt::format("no curves of episode {}: {}", choice.episode, error.what()));
    }
  }
}

// Adds the pacing of a realtime run, unless an episode lacks it.
void AddPacing(const results::RecordedRun& recorded, report::ReportRun* run) {
  if (!recorded.info.value("realtime", false)) return;
  std::vector<nlohmann::ordered_json> episodes;
  for (const results::RecordedEpisode& episode : recorded.episodes) episodes.push_back(episode.Json());
  const nlohmann::ordered_json pacing = results::RunPacing(episodes);
  if (pacing.is_null()) return;
  run->pacing = results::PacingSentence(pacing) + " Times of the worst episode:";
  for (const results::PacingTimes& times : results::kPacingTimes) {
    const nlohmann::ordered_json& json = pacing[times.key];
    run->times.push_back({times.name, json["p50_s"], json["p99_s"], json["p999_s"], json["max_s"]});
  }
}

report::ReportRun Run(const results::RecordedRun& recorded, const std::vector<int>& episodes, bool in_suite,
                      const report::PageLinks& links) {
  const metrics::RunSummary summary = recorded.Statistics().Summary(true);
  report::ReportRun run;
  run.name = recorded.name;
  run.task = recorded.task;
  run.variation = recorded.variation;
  run.policy = recorded.policy;
  for (const results::RecordedEpisode& episode : recorded.episodes) {
    run.episode.push_back(Episode(episode));
    run.episode.back().videos = links.Videos(recorded.folder, episode.episode);
    run.episode.back().logs = links.Log(recorded.folder, episode.episode);
  }
  if (std::ranges::all_of(run.episode, [](const auto& episode) { return episode.videos.empty(); })) {
    run.video_hint = "There are no videos of this run: evalbus render " + recorded.name +
                     " renders them; running evalbus report again then links them here.";
  }
  run.episodes = summary.episodes;
  run.complete = summary.complete;
  run.successes = summary.successes;
  run.not_judged = summary.complete - summary.judged;
  run.intervals = {{"Wilson", summary.wilson.lower, summary.wilson.upper},
                   {"Clopper-Pearson", summary.clopper_pearson.lower, summary.clopper_pearson.upper}};
  run.stages = Stages(summary);
  run.failure_reasons.assign(summary.failure_reasons.begin(), summary.failure_reasons.end());
  run.collisions = summary.collisions_per_geom;
  run.remarks = recorded.Remarks();
  run.notes = results::PolicyNotes(recorded);
  run.metrics = Metrics(summary);
  AddPacing(recorded, &run);
  const auto add = [&](const std::string& key, const nlohmann::ordered_json& value) {
    run.made.emplace_back(key, value.is_string() ? value.get<std::string>() : value.dump());
  };
  for (const auto& [key, value] : recorded.info.items()) {
    if (!value.is_object()) {
      add(key, value);
      continue;
    }
    for (const auto& [part, of_part] : value.items()) add(fmt::format("{}.{}", key, part), of_part);
  }
  std::vector<Choice> choices;
  for (const int episode : episodes) choices.push_back({episode, ""});
  if (episodes.empty()) choices = ChooseEpisodes(recorded, in_suite ? 1 : kFailuresDrawn);
  if (in_suite) choices.resize(std::min<size_t>(choices.size(), 1));
  AddCurves(recorded, choices, !episodes.empty(), &run);
  if (in_suite) {
    for (report::ReportCurves& curves : run.curves) {
      curves.figures.resize(std::min(curves.figures.size(), kFiguresInSuite));
    }
  }
  return run;
}

void AddOptions(CLI::App* app, ReportOptions* options) {
  app->add_option("run", options->run, "folder of a run, a suite or a plan")->required();
  app->add_option("-o,--out", options->out, "HTML file; default: report.html in that folder")
      ->type_name("FILE");
  app->add_option(
         "--episode", options->episodes,
         "numbers of the episodes whose curves are drawn and which can be played in 3D, separated by commas; "
         "default: the first failures and the success with the median time; in 3D as many as fit")
      ->delimiter(',');
  app->add_option(
         "--mb", options->megabytes,
         "maximum size of the page in megabytes; as many episodes as fit can be played in 3D; 0: none")
      ->check(CLI::Range(0.0, 2000.0))
      ->capture_default_str();
}

// Packs each run's episodes with curves first, then its failures, then the others; in a suite one episode of
// each run, then the next one of each. Returns a sentence about the packed episodes.
std::string AddViewer(const results::RecordedRuns& runs, const ReportOptions& options,
                      const report::PageLinks& links, report::Report* report) {
  report::ViewerPack pack(links);
  std::vector<std::vector<int>> order;
  size_t longest = 0;
  for (size_t run = 0; run < runs.runs.size(); ++run) {
    pack.Add(runs.runs[run]);
    std::vector<int> first;
    for (const report::ReportCurves& curves : report->runs[run].curves) first.push_back(curves.episode);
    order.push_back(options.episodes.empty() ? report::FailuresFirst(runs.runs[run], first)
                                             : options.episodes);
    longest = std::max(longest, order.back().size());
  }
  std::vector<std::vector<report::ViewerPack::Wanted>> wanted;
  for (size_t k = 0; k < longest; ++k) {
    for (size_t run = 0; run < order.size(); ++run) {
      if (k < order[run].size()) wanted.push_back({{static_cast<int>(run), order[run][k]}});
    }
  }
  pack.Pack(wanted, report::ReportPage(*report).size(), static_cast<size_t>(options.megabytes * 1e6));
  for (const std::string& remark : pack.remarks()) report->remarks.push_back(remark);
  report->viewer = pack.Viewer();
  return pack.Note();
}

// Prints the page's path, its size and the number of packed episodes. Returns the exit code. Throws
// InputError, EnvironmentError.
int WriteReport(const ReportOptions& options) {
  if (fs::exists(options.run / plans::kPlanJson)) {
    if (!options.out.empty() || !options.episodes.empty()) {
      throw InputError(options.run.string() +
                       ": a plan, whose page is always its report.html; -o and --episode require a run");
    }
    const plans::PlanFolder folder(options.run);
    plans::WritePlanPages(folder, plans::ReadPlanResults(folder));
    fmt::print("{}\n", fs::proximate(options.run / "report.html").string());
    return 0;
  }
  const results::RecordedRuns runs = results::ReadRuns(options.run);
  if (runs.is_suite && !options.episodes.empty()) {
    throw InputError("--episode: " + options.run.string() + " is a suite; pass one of its runs");
  }
  const fs::path out = options.out.empty() ? options.run / "report.html" : options.out;
  const report::PageLinks links(out);
  report::Report report;
  report.made_by = fmt::format("{} ({}{})", kVersion, kGitCommit, kGitDirty ? ", with changes" : "");
  for (const results::RecordedRun& run : runs.runs) {
    report.runs.push_back(Run(run, options.episodes, runs.is_suite, links));
  }
  for (const std::string& missing : runs.missing) report.remarks.push_back("no finished episode: " + missing);
  report.title = runs.is_suite ? fmt::format("{} in {}", Plural(runs.runs.size(), "run"), runs.name)
                               : runs.runs[0].task_name();
  std::string note;
  if (options.megabytes > 0) note = AddViewer(runs, options, links, &report);
  const std::string page = report::ReportPage(report);
  WriteWhole(out, page);
  fmt::print("{}\n", fs::proximate(out).string());
  if (!note.empty()) {
    fmt::print("{} The page has {:.1f} MB.\n", note, static_cast<double>(page.size()) / 1e6);
  }
  return 0;
}

}  // namespace

Action AddReport(CLI::App* app) {
  const auto options = std::make_shared<ReportOptions>();
  AddOptions(app, options.get());
  return [options] { return WriteReport(*options); };
}

}  // namespace evalbus::commands
