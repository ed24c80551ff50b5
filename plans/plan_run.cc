#include "plans/plan_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "plans/plan_report.h"
#include "plans/stop_rule.h"
#include "results/comparison.h"
#include "results/comparison_json.h"
#include "results/comparison_text.h"
#include "results/run_reader.h"
#include "results/summary_table.h"
#include "runner/suite.h"
#include "viz/images/video.h"
#include "viz/terminal/terminal.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Output of a plan's events. lines: null if no events are printed. output: options for the events of the
// runs.
struct Events {
  runner::EventLines* lines = nullptr;
  runner::RunOutput output{};
};

// Returns true if this run already has more than `episodes` requested episodes, from a later step before the
// plan was interrupted.
bool HasMore(const fs::path& run, int episodes) {
  const fs::path file = run / kRunJson;
  return fs::exists(file) && ReadJsonFile<ordered_json>(file).value("episodes", 0) > episodes;
}

// Runs the suites of these policies, with `episodes` episodes of each task. Runs that already have more
// episodes, from a later step before the plan was interrupted, are not changed.
void RunSuites(const PlanFolder& folder, const std::set<std::string>& policies, int episodes, int workers,
               const Events& events) {
  const Plan& plan = folder.plan();
  std::map<std::string, runner::Suite> suites;
  std::map<std::string, std::pair<std::string, std::string>> of_job;  // policy and task
  std::set<std::string> ahead;  // policies with such runs; a later step writes the summary of their suite
  std::vector<runner::Job> jobs;
  std::vector<fs::path> runs;
  int policy_width = Width("policy"), task_width = Width("task");
  for (const PlannedPolicy& policy : plan.policies) {
    if (!policies.contains(policy.name)) continue;
    runner::RunOptions options = plan.OptionsOf(policy);
    options.episodes = episodes;
    options.out = folder.policy_folder(policy.name);
    options.resume = true;
    const runner::Suite& suite = suites
                                     .emplace(std::piecewise_construct, std::forward_as_tuple(policy.name),
                                              std::forward_as_tuple(options, plan.tasks))
                                     .first->second;
    for (runner::Job& job : suite.Jobs(events.output)) {
      const std::string task = job.name;
      if (plan.until && HasMore(suite.run_folder(task), episodes)) {
        ahead.insert(policy.name);
        continue;
      }
      job.name = policy.name + "  " + task;
      policy_width = std::max(policy_width, Width(policy.name));
      task_width = std::max(task_width, Width(task));
      of_job[job.name] = {policy.name, task};
      jobs.push_back(std::move(job));
      runs.push_back(suite.run_folder(task));
    }
  }
  if (jobs.empty()) return;
  const auto name_of = [&](const std::string& policy, const std::string& task) {
    return Pad(policy, -policy_width) + "  " + task;
  };
  const auto width = static_cast<size_t>(policy_width + 2 + task_width);
  const bool colors = UsesColors(stdout);
  fmt::print("{} of {}, {} at a time\n{}", Plural(static_cast<int64_t>(jobs.size()), "run"),
             Plural(episodes, "episode"), workers,
             results::Tally::Title(name_of("policy", "task"), width, colors));
  std::fflush(stdout);
  runner::JobsProgress progress(jobs.size(), "runs", runs, episodes);
  const bool is_whole =
      runner::RunJobs(std::move(jobs), workers, &progress, events.lines, [&](const std::string& job) {
        const auto& [policy, task] = of_job.at(job);
        fmt::print("{}", suites.at(policy).Ended(task).Line(name_of(policy, task), width, colors));
      });
  for (const auto& [name, suite] : suites) {
    if (!ahead.contains(name)) suite.WriteSummary();
  }
  if (is_whole) return;
  throw EnvironmentError("stopped; to resume, run " + results::SameCommand(fs::proximate(folder.path())));
}

// Runs the plan in steps of plan.options.episodes episodes. A policy stops when ended(policy, episodes) is
// true. The baseline of a comparison runs as long as any other policy does.
template <class Ended>
void RunInSteps(const PlanFolder& folder, int workers, const Events& events, const Ended& ended) {
  const Plan& plan = folder.plan();
  std::set<std::string> going;
  for (const PlannedPolicy& policy : plan.policies) going.insert(policy.name);
  const bool keeps_baseline = !plan.until->width;
  for (int episodes = plan.options.episodes;; episodes = NextLook(plan, episodes)) {
    RunSuites(folder, going, episodes, workers, events);
    std::erase_if(going, [&](const std::string& policy) {
      return !(keeps_baseline && policy == plan.baseline) && ended(policy, episodes);
    });
    if (going.size() <= (keeps_baseline ? 1 : 0)) return;
    fmt::print("\n");
  }
}

// Runs episodes until each comparison has ended.
void RunUntilDecided(const PlanFolder& folder, int workers, const Events& events) {
  const Plan& plan = folder.plan();
  std::map<std::string, Stop> stops;
  RunInSteps(folder, workers, events, [&](const std::string& policy, int episodes) {
    Stop& stop = stops[policy];
    stop = LookAtDifference(folder, policy, stop, episodes);
    if (!stop.has_ended(*plan.until)) return false;
    fmt::print("{}: {}\n", policy, stop.Text(plan.baseline, *plan.until));
    return true;
  });
}

// Runs episodes until the intervals of each policy are narrow enough, or until the plan's maximum.
void RunUntilNarrow(const PlanFolder& folder, int workers, const Events& events) {
  RunInSteps(folder, workers, events, [&](const std::string& policy, int episodes) {
    const WidthStop stop = LookAtWidth(folder, policy, episodes);
    if (!stop.has_ended(*folder.plan().until)) return false;
    fmt::print("{}: {}\n", policy, stop.Text(*folder.plan().until));
    return true;
  });
}

std::vector<int> EpisodesForVideo(const PlannedVideos& videos, const results::RecordedRun& run) {
  using Which = PlannedVideos::Which;
  std::vector<int> episodes;
  for (const results::RecordedEpisode& episode : run.episodes) {
    const bool is_wanted = videos.which == Which::kAll ||
                           (videos.which == Which::kFailures && !episode.success) ||
                           (videos.which == Which::kFirst && episode.episode < videos.first);
    const auto is_there = [&](const std::string& camera) {
      return fs::exists(EpisodeFolder(run.folder, episode.episode) / viz::VideoName(camera));
    };
    if (is_wanted && !std::ranges::all_of(videos.cameras, is_there)) episodes.push_back(episode.episode);
  }
  return episodes;
}

void MakeVideos(const PlanFolder& folder, int workers) {
  const Plan& plan = folder.plan();
  std::vector<runner::Job> jobs;
  if (plan.videos.which == PlannedVideos::Which::kNone) return;
  for (const PlannedPolicy& policy : plan.policies) {
    for (const std::string& task : plan.tasks) {
      const fs::path run = folder.run_folder(policy.name, task);
      const std::vector<int> episodes = EpisodesForVideo(plan.videos, results::ReadRun(run));
      if (episodes.empty()) continue;
      jobs.push_back({policy.name + "  " + task,
                      {(runner::Processes::BinaryFolder() / "evalbus").string(), "render", run.string(),
                       "--episode", fmt::format("{}", fmt::join(episodes, ",")), "--camera",
                       fmt::format("{}", fmt::join(plan.videos.cameras, ",")), "--gl", plan.options.gl},
                      LogFile(run, "video")});
    }
  }
  runner::JobsProgress progress(jobs.size(), "runs recorded as video");
  if (!runner::RunJobs(std::move(jobs), workers, &progress, nullptr, [](const std::string&) {})) {
    throw EnvironmentError(
        "stopped before all videos were recorded; to resume, run the same command with --resume");
  }
}

void RunAll(const PlanFolder& folder, int workers, const Events& events) {
  std::set<std::string> all;
  for (const PlannedPolicy& policy : folder.plan().policies) all.insert(policy.name);
  RunSuites(folder, all, folder.plan().options.episodes, workers, events);
}

// Removes the folder of shards if this plan has none.
void RemoveEmptyParts(const PlanFolder& folder) {
  std::error_code not_empty;
  fs::remove(folder.path() / kPartsFolder, not_empty);
}

void WriteBegin(const PlanFolder& folder, runner::EventLines* lines) {
  const Plan& plan = folder.plan();
  std::vector<std::string> policies;
  for (const PlannedPolicy& policy : plan.policies) policies.push_back(policy.name);
  lines->Write("plan_begin", {{"plan", folder.path().string()},
                              {"name", plan.name},
                              {"policies", policies},
                              {"tasks", plan.tasks},
                              {"baseline", plan.baseline},
                              {"seed", plan.options.seed},
                              {"episodes", plan.options.episodes}});
}

void WriteSummary(const PlanFolder& folder, const PlanResults& results, runner::EventLines* lines) {
  ordered_json summaries, comparison;
  for (const PlannedPolicy& policy : folder.plan().policies) {
    summaries[policy.name] = ReadJsonFile<ordered_json>(folder.policy_folder(policy.name) / kSummaryJson);
  }
  if (!results.comparisons.empty())
    comparison = results::ComparisonJson(results.comparisons, results.ranking);
  lines->Write("plan_summary", {{"plan", folder.path().string()},
                                {"summaries", std::move(summaries)},
                                {"comparison", std::move(comparison)}});
}

// Returns the first failed episode of each policy that has one.
std::vector<results::PolicyFailure> FirstFailures(const PlanResults& results) {
  std::vector<results::PolicyFailure> failures;
  for (const results::RecordedRuns& suite : results.suites) {
    for (const results::RecordedRun& run : suite.runs) {
      const auto failed = std::ranges::find_if(run.episodes, [](const results::RecordedEpisode& episode) {
        return episode.complete && !episode.success && episode.judged();
      });
      if (failed == run.episodes.end()) continue;
      failures.push_back({suite.name,
                          fs::proximate(run.folder).string(),
                          {failed->episode, failed->failure_reason, failed->cause}});
      break;
    }
  }
  return failures;
}

}  // namespace

void RunPlan(const PlanFolder& folder, int workers, const runner::RunOutput& output) {
  InstallStopSignals();
  const Plan& plan = folder.plan();
  std::optional<runner::EventLines> lines;
  if (output.json) lines.emplace(output.quiet);
  const Events events{lines ? &*lines : nullptr, output};
  if (lines) WriteBegin(folder, &*lines);
  fmt::print("plan {}: {} polic{} on {}\n", plan.name, plan.policies.size(),
             plan.policies.size() == 1 ? "y" : "ies", Plural(plan.tasks.size(), "task"));
  try {
    if (plan.until) {
      (plan.until->width ? RunUntilNarrow : RunUntilDecided)(folder, workers, events);
    } else {
      RunAll(folder, workers, events);
    }
  } catch (const EnvironmentError& error) {
    // The message of a plan that was stopped already contains the command.
    if (stop_requested()) throw;
    throw EnvironmentError(fmt::format("{}; to resume, run {}", error.what(),
                                       results::SameCommand(fs::proximate(folder.path()))));
  }
  if (plan.until) WriteWhole(folder.path() / kStopsJson, ToText(StopsJson(folder), 2) + "\n");
  RemoveEmptyParts(folder);
  const PlanResults results = FinishPlan(folder, workers);
  if (lines) WriteSummary(folder, results, &*lines);
}

void RunAllEpisodes(const PlanFolder& folder, int workers) {
  InstallStopSignals();
  RunAll(folder, workers, {});
  RemoveEmptyParts(folder);
}

PlanResults FinishPlan(const PlanFolder& folder, int workers) {
  const Plan& plan = folder.plan();
  PlanResults results = ReadPlanResults(folder);
  const int width = viz::TerminalWidth(stdout);
  const bool colors = UsesColors(stdout);
  for (const results::Comparison& comparison : results.comparisons)
    fmt::print("\n{}", results::ConclusionText(comparison, width, colors));
  if (!results.ranking.empty()) fmt::print("\n{}", results::RankingText(results.ranking, width));
  std::fflush(stdout);
  // If videos cannot be recorded, for example because ffmpeg is missing, the results are still compared and
  // reported.
  std::string no_videos;
  try {
    MakeVideos(folder, workers);
  } catch (const std::exception& error) {
    if (stop_requested()) throw;
    no_videos = error.what();
  }
  std::vector<runner::Job> pages;
  const std::string evalbus = (runner::Processes::BinaryFolder() / "evalbus").string();
  for (const PlannedPolicy& policy : plan.policies) {
    const fs::path own = folder.policy_folder(policy.name);
    pages.push_back({"report of " + policy.name, {evalbus, "report", own.string()}, LogFile(own, "report")});
    fs::create_directories(pages.back().log_file.parent_path());
  }
  runner::JobsProgress progress(pages.size(), "pages");
  const fs::path shown = fs::proximate(folder.path());
  if (!runner::RunJobs(std::move(pages), workers, &progress, nullptr, [](const std::string&) {})) {
    throw EnvironmentError("stopped before all pages were written; to write them, run " +
                           results::SameCommand(shown));
  }
  WritePlanPages(folder, results);
  if (const auto failures = FirstFailures(results); !failures.empty())
    fmt::print("\n{}", results::PolicyFailuresText(failures, width, colors));
  fmt::print("\nreport   {}\nlook     {}\nshare    {}\n", (shown / kReportHtml).string(),
             ShellWords({"evalbus", "web", shown.string()}),
             ShellWords({"evalbus", "report", shown.string()}));
  if (!no_videos.empty()) {
    throw EnvironmentError(fmt::format("videos are missing: {}; to record them, run {}", no_videos,
                                       results::SameCommand(shown)));
  }
  return results;
}

}  // namespace evalbus::plans
