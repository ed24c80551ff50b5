#include "cli/plans/plan_report.h"

#include <fmt/format.h>

#include <map>
#include <optional>

#include "base/input_file.h"
#include "base/json_file.h"
#include "base/write_whole.h"
#include "cli/launch/version.h"
#include "cli/plans/plan_run.h"
#include "cli/results/comparison.h"
#include "cli/results/run_reader.h"
#include "metrics/statistics/run_statistics.h"
#include "viz/report/plan_page.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using results::RecordedRun;
using results::RecordedRuns;

viz::PlanCell CellOf(const metrics::RunSummary& summary) {
  return {summary.successes, summary.complete, summary.wilson.lower, summary.wilson.upper, "", {}};
}

// A policy's report, into which some of its episodes are packed to be watched.
class ReportWithEpisodes {
 public:
  ReportWithEpisodes(const fs::path& folder, const fs::path& page) : url_(viz::Url(page)) {
    if (fs::exists(folder / page)) text_ = ReadInput(folder / page, "report");
  }
  const std::string& url() const { return url_; }
  // Where the viewer shows it; empty where it is not packed.
  std::string UrlOf(size_t run, int episode) const {
    if (text_.find(fmt::format("data-block=\"episode/{}/{}\"", run, episode)) == std::string::npos) return "";
    return fmt::format("{}#view:run={},episode={}", url_, run, episode);
  }

 private:
  std::string url_, text_;
};

// The first failure that can be watched, else the first episode; and by reason the first that failed for it.
void AddEpisodes(const RecordedRun& recorded, size_t run, const ReportWithEpisodes& page, viz::PlanCell* cell,
                 std::map<std::string, std::string>* failed) {
  for (const bool success : {false, true}) {
    for (const results::RecordedEpisode& episode : recorded.episodes) {
      const bool is_wanted =
          cell->episodes.empty() || (!success && !failed->contains(episode.failure_reason));
      if (!episode.complete || episode.success != success || !is_wanted) continue;
      const std::string url = page.UrlOf(run, episode.episode);
      if (url.empty()) break;  // failures were packed first, and in order
      if (cell->episodes.empty()) cell->episodes.push_back({fmt::format("episode {}", episode.episode), url});
      if (!success) failed->emplace(episode.failure_reason, url);
    }
  }
}

// Of all tasks; each episode has a number of its own.
metrics::RunSummary SummaryOf(const RecordedRuns& suite) {
  metrics::RunStatistics statistics;
  int number = 0;
  for (const RecordedRun& run : suite.runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      statistics.Add(number++, episode.result);
    }
  }
  return statistics.Summary(false);
}

}  // namespace

fs::path ComparisonPageOf(const PlanFolder& folder, const std::string& policy) {
  return folder.policy_folder(policy) / ("against_" + folder.plan().baseline + ".html");
}

void WritePlanReport(const PlanFolder& folder) {
  const Plan& plan = folder.plan();
  viz::PlanReport report;
  report.title = plan.name;
  report.baseline = plan.baseline;
  std::map<std::string, viz::PlanRow> rows;
  std::vector<std::string> order;  // of tasks, as the suites have them
  std::vector<RecordedRuns> suites;
  std::optional<RecordedRuns> baseline;
  for (const PlannedPolicy& policy : plan.policies) {
    RecordedRuns suite = results::ReadRuns(folder.policy_folder(policy.name));
    suite.name = policy.name;
    const ReportWithEpisodes page(folder.path(), fs::path(policy.name) / "report.html");
    report.policies.push_back(policy.name);
    report.reports.push_back({policy.name, page.url()});
    auto& failed = report.failed_episodes.emplace_back();
    std::vector<std::pair<std::string, viz::PlanCell>> cells;
    for (size_t i = 0; i < suite.runs.size(); ++i) {
      viz::PlanCell& cell =
          cells.emplace_back(suite.runs[i].task_name(), CellOf(suite.runs[i].Statistics().Summary(false)))
              .second;
      cell.url = page.url() + (suite.runs.size() > 1 ? fmt::format("#run-{}-", i) : "");
      AddEpisodes(suite.runs[i], i, page, &cell, &failed);
      for (const std::string& remark : suite.runs[i].Remarks()) {
        report.remarks.push_back(policy.name + ", " + suite.runs[i].task_name() + ": " + remark);
      }
    }
    for (const std::string& missing : suite.missing) {
      report.remarks.push_back(policy.name + ": no finished episode of " + missing);
    }
    for (const auto& [task, cell] : cells) {
      const auto [row, is_new] = rows.emplace(task, viz::PlanRow{task, {}});
      if (is_new) order.push_back(task);
      row->second.cells.resize(report.policies.size());
      row->second.cells.back() = cell;
    }
    const metrics::RunSummary all = SummaryOf(suite);
    report.all.cells.push_back(CellOf(all));
    report.failure_reasons.push_back(all.failure_reasons);
    if (policy.name == plan.baseline) {
      baseline = std::move(suite);
    } else {
      suites.push_back(std::move(suite));
    }
  }
  report.all.name = "all";
  for (const std::string& task : order) {
    report.tasks.push_back(rows[task]);
    report.tasks.back().cells.resize(report.policies.size());
  }
  const auto comparison_url = [&](const std::string& policy) {
    return viz::Url(fs::relative(ComparisonPageOf(folder, policy), folder.path()));
  };
  if (const fs::path stops = folder.path() / kStopsJson; plan.until && fs::exists(stops)) {
    report.verdict_note = fmt::format(
        "Looked at every {} episodes of each task, {} at most: p values that hold at any look, by Bonferroni "
        "over the "
        "policies.",
        plan.options.episodes, plan.until->max_episodes);
    for (const auto& stop : ReadJsonFile(stops)) {
      const std::string policy = stop.at("policy");
      const bool is_better = stop.at("only_policy") > stop.at("only_baseline");
      report.verdicts.push_back({.policy = policy,
                                 .text = stop.at("text"),
                                 .p = stop.at("p"),
                                 .judgement = !stop.at("is_decided") ? ""
                                              : is_better            ? "better"
                                                                     : "worse",
                                 .url = comparison_url(policy)});
    }
  } else if (!suites.empty()) {
    report.verdict_note = "p values by Holm, over the policies that are compared.";
    for (const results::Comparison& comparison : results::CompareAll(suites, *baseline)) {
      report.verdicts.push_back({.policy = comparison.run.name,
                                 .text = results::Conclusion(comparison),
                                 .p = comparison.success.p_holm,
                                 .judgement = results::Word(comparison.success.judgement()),
                                 .url = comparison_url(comparison.run.name)});
    }
  }
  WriteWhole(folder.path() / "report.html",
             viz::PlanPage(
                 report, fmt::format("{} ({}{})", kVersion, kGitCommit, kGitDirty ? ", with changes" : "")));
}

}  // namespace evalbus::plans
