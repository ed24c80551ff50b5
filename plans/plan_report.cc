#include "plans/plan_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "metrics/statistics/run_statistics.h"
#include "report/comparison_report.h"
#include "report/page/page_check.h"
#include "report/page/plan_page.h"
#include "report/viewer_pack.h"
#include "results/conclusion.h"
#include "results/run_reader.h"
#include "results/run_summary.h"
#include "results/summary_table.h"
#include "runner/version.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using results::RecordedRun;
using results::RecordedRuns;

// A policy's report page, which contains some of its episodes for playback.
class ReportWithEpisodes {
 public:
  ReportWithEpisodes(const fs::path& folder, const fs::path& page) : url_(report::Url(page)) {
    if (fs::exists(folder / page)) text_ = ReadInput(folder / page, "report");
  }
  const std::string& url() const { return url_; }
  // Returns the URL of an episode in the page's player; empty if the page does not contain the episode.
  std::string UrlOf(size_t run, const results::RecordedEpisode& episode) const {
    const std::string block = fmt::format("data-block=\"episode/{}/{}\"", run, episode.episode);
    if (text_.find(block) == std::string::npos) return "";
    return url_ + report::PlayerUrl({static_cast<int>(run), episode.episode}, episode.cause);
  }

 private:
  std::string url_, text_;
};

// Adds a link to the first failure that can be played or, if there is none, to the first playable success.
// Also adds a link to the first playable failure of each failure reason.
void AddEpisodes(const RecordedRun& recorded, size_t run, const ReportWithEpisodes& page,
                 report::PlanCell* cell, std::map<std::string, std::string>* failed) {
  for (const bool success : {false, true}) {
    for (const results::RecordedEpisode& episode : recorded.episodes) {
      const bool is_wanted =
          cell->episodes.empty() || (!success && !failed->contains(episode.failure_reason));
      if (!episode.complete || episode.success != success || !is_wanted) continue;
      const std::string url = page.UrlOf(run, episode);
      if (url.empty()) break;  // failures were packed first and in order
      if (cell->episodes.empty()) cell->episodes.push_back({fmt::format("episode {}", episode.episode), url});
      if (!success) failed->emplace(episode.failure_reason, url);
    }
  }
}

// Returns false if no episode of this policy has finished.
bool HasEpisodes(const fs::path& folder) {
  if (fs::exists(folder / kRunJson)) return fs::exists(folder / kEpisodesJsonl);
  return fs::exists(folder / kSuiteJson) &&
         std::ranges::any_of(results::RunsInSuite(folder), [&](const std::string& run) {
           return fs::exists(folder / run / kEpisodesJsonl);
         });
}

}  // namespace

PlanResults ReadPlanResults(const PlanFolder& folder) {
  const Plan& plan = folder.plan();
  PlanResults results;
  std::vector<RecordedRuns> others;
  std::vector<const RecordedRuns*> all;
  for (const PlannedPolicy& policy : plan.policies) {
    if (!HasEpisodes(folder.policy_folder(policy.name))) {
      const fs::path shown = fs::proximate(folder.path());
      throw InputError(fmt::format("{}: policy '{}' has no finished episode; to continue the plan: {}",
                                   shown.string(), policy.name, results::SameCommand(shown)));
    }
    results.suites.push_back(results::ReadRuns(folder.policy_folder(policy.name)));
    results.suites.back().name = policy.name;
  }
  const RecordedRuns* baseline = nullptr;
  for (const RecordedRuns& suite : results.suites) {
    all.push_back(&suite);
    if (suite.name == plan.baseline) {
      baseline = &suite;
    } else {
      others.push_back(suite);
    }
  }
  const fs::path stops_file = folder.path() / kStopsJson;
  // With `width`, stops.json contains no comparisons.
  const bool is_sequential = plan.until && !plan.until->width && fs::exists(stops_file);
  results.comparisons = results::CompareAll(others, *baseline, {}, is_sequential);
  if (!plan.until) {
    results.ranking = results::RankBySuccess(all);
    return results;
  }
  if (!is_sequential) return results;
  const auto stops = ReadJsonFile(stops_file);
  for (results::Comparison& comparison : results.comparisons) {
    const auto stop = std::ranges::find_if(
        stops, [&](const auto& entry) { return entry.at("policy") == comparison.run.name; });
    if (stop == stops.end())
      throw InputError(stops_file.string() + ": no decision on policy " + comparison.run.name);
    // Plans of older versions tested only success.
    const auto of_success = [&](const char* key, const char* older) {
      return stop->contains(key) ? stop->at(key) : stop->at(older);
    };
    comparison.success.SetSequential(of_success("success_p_unadjusted", "p_unadjusted"),
                                     of_success("success_p", "p"),
                                     of_success("is_success_decided", "is_decided"));
    results.stops.push_back(stop->at("text"));
    // The p values of single tasks do not account for the repeated tests.
    if (comparison.tasks.size() > 1) {
      for (results::TaskComparison& task : comparison.tasks) task.success.is_shown = false;
    }
    comparison.remarks.insert(
        comparison.remarks.begin(),
        "The plan tested its results during the evaluation, and the number of episodes depends on them. p of "
        "success over all tasks accounts for this. The difference shown is on average larger than the true "
        "one, and p values of single tasks and of metrics assume a single test.");
  }
  return results;
}

report::TextTable RateTable(const PlanResults& results) {
  report::TextTable table = {.header = {"task"}, .rows = {}};
  std::vector<std::string> tasks;
  for (const RecordedRuns& suite : results.suites) {
    table.header.push_back(suite.name);
    for (const RecordedRun& run : suite.runs) {
      if (std::ranges::find(tasks, run.task_name()) == tasks.end()) tasks.push_back(run.task_name());
    }
  }
  // Returns the cells of a task; of all tasks if it is empty.
  const auto row = [&](const std::string& task) {
    std::vector<std::string> cells = {task.empty() ? "all" : task};
    for (const RecordedRuns& suite : results.suites) {
      results::Tally tally;
      for (const RecordedRun& run : suite.runs) {
        if (task.empty() || run.task_name() == task) tally.Add(run);
      }
      const metrics::RunSummary summary = tally.Summary();
      cells.push_back(report::RateCell(summary.successes, summary.judged, summary.InSamples(summary.judged)));
    }
    return cells;
  };
  for (const std::string& task : tasks) table.rows.push_back(row(task));
  if (tasks.size() > 1) table.rows.push_back(row(""));
  return table;
}

std::map<fs::path, std::string> PlanPages(const PlanFolder& folder, const PlanResults& results, size_t most) {
  const Plan& plan = folder.plan();
  std::map<fs::path, std::string> pages;
  const std::string made_by =
      fmt::format("{} ({}{})", kVersion, kGitCommit, kGitDirty ? ", with changes" : "");
  report::PlanReport report;
  report.title = plan.name;
  report.baseline = plan.baseline;
  std::map<std::string, report::PlanRow> rows;
  std::vector<std::string> order;  // tasks, in the order of the suites
  for (const RecordedRuns& suite : results.suites) {
    const ReportWithEpisodes page(folder.path(), fs::path(suite.name) / "report.html");
    report.policies.push_back(suite.name);
    report.reports.push_back({suite.name, page.url()});
    auto& failed = report.failed_episodes.emplace_back();
    std::vector<std::pair<std::string, report::PlanCell>> cells;
    results::Tally tally;
    for (const RecordedRun& run : suite.runs) tally.Add(run);
    const metrics::RunSummary all = tally.Summary();
    // If no start was seen in training, one remark on all runs replaces the remarks on each run.
    const bool has_seen_none = all.seen_in_training == 0 && suite.runs.size() > 1;
    if (has_seen_none) report.remarks.push_back(suite.name + ": " + all.TrainingText());
    for (size_t i = 0; i < suite.runs.size(); ++i) {
      report::PlanCell& cell = cells.emplace_back(suite.runs[i].task_name(), report::PlanCell{}).second;
      cell.summary = suite.runs[i].Statistics().Summary(false);
      cell.url = page.url() + (suite.runs.size() > 1 ? fmt::format("#run-{}-", i) : "");
      AddEpisodes(suite.runs[i], i, page, &cell, &failed);
      for (const std::string& remark : suite.runs[i].Remarks()) {
        if (has_seen_none && remark == cell.summary.TrainingText()) continue;
        report.remarks.push_back(suite.name + ", " + suite.runs[i].task_name() + ": " + remark);
      }
    }
    for (const std::string& missing : suite.missing) {
      report.remarks.push_back(suite.name + ": no finished episode of " + missing);
    }
    for (const auto& [task, cell] : cells) {
      const auto [row, is_new] = rows.emplace(task, report::PlanRow{task, {}});
      if (is_new) order.push_back(task);
      row->second.cells.resize(report.policies.size());
      row->second.cells.back() = cell;
    }
    report.all.cells.push_back({.summary = all});
    results::SuiteTally tasks;
    for (const RecordedRun& run : suite.runs) tasks.Add(run.task_name(), run);
    report.means.push_back(tasks.mean_over_tasks());
  }
  report.all.name = "all";
  for (const std::string& task : order) {
    report.tasks.push_back(rows[task]);
    report.tasks.back().cells.resize(report.policies.size());
  }
  for (size_t i = 0; i < results.comparisons.size(); ++i) {
    const results::Comparison& comparison = results.comparisons[i];
    const std::string& policy = comparison.run.name;
    const fs::path page = folder.policy_folder(policy) / ("against_" + plan.baseline + ".html");
    const ordered_json source = {{"page", report::kPlanComparisonPage},
                                 {"folder", report::RelativeToPage(folder.path(), page)}};
    pages[page] = report::ComparisonReport({comparison}, page, made_by, most, source).html;
    std::string text = results::Conclusion(comparison);
    if (i < results.stops.size()) text += " The plan: " + results.stops[i] + ".";
    report.verdicts.push_back({.policy = policy,
                               .text = text,
                               .difference = results::DifferenceText(comparison.success),
                               .judgment = results::Word(comparison.success.judgment()),
                               .url = report::Url(fs::relative(page, folder.path()))});
  }
  // A single comparison is not adjusted.
  const bool is_adjusted = results.comparisons.size() > 1;
  if (!results.stops.empty()) {
    report.verdict_note = fmt::format(
        "Tested after every {} episodes of each task, at most {}: p values are valid at any look{}.",
        plan.options.episodes, plan.until->max_episodes,
        is_adjusted ? ", adjusted with Bonferroni's method for the policies that are compared" : "");
  } else if (is_adjusted) {
    report.verdict_note = "p values are adjusted with Holm's method for the policies that are compared.";
  }
  report.ranking = results.ranking;
  report.verdict = results::RankingHeadline(results.ranking, results.comparisons);
  pages[folder.path() / kReportHtml] = report::PlanPage(report, made_by);
  return pages;
}

void WritePlanPages(const PlanFolder& folder, const PlanResults& results) {
  for (const auto& [file, html] :
       PlanPages(folder, results, static_cast<size_t>(report::kPageMegabytes * 1e6)))
    WriteWhole(file, html);
}

}  // namespace evalbus::plans
