#include "report/page/plan_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <set>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "report/page/figures.h"
#include "report/page/page_check.h"
#include "results/summary_table.h"

namespace evalbus::report {
namespace {

void Cell(const PlanCell& cell, const std::string& label, Markup* html) {
  const metrics::RunSummary& summary = cell.summary;
  if (summary.judged == 0) {
    html->Element("td", {{"class", "number"}, {"data-label", label}}, "-");
    return;
  }
  const double rate = summary.success_rate;
  html->Element("td", {{"class", "number share"}, {"data-label", label}}, [&] {
    const std::string text = Percent(rate);
    if (cell.url.empty()) {
      Data(rate, text, html);
    } else {
      html->Element("a", {{"href", cell.url}}, [&] { Data(rate, text, html); });
    }
    html->Element("div", {},
                  [&] { DrawShare(rate, summary.wilson.lower, summary.wilson.upper, false, html); });
    html->Element("div", {{"class", "note"}}, fmt::format("{} of {}", summary.successes, summary.judged));
    html->Element("div", {{"class", "note"}}, results::PercentText(summary.wilson));
    if (cell.episodes.empty()) return;
    html->Element("div", {{"class", "note"}, {kUnchecked, ""}}, [&] { Links(cell.episodes, html); });
  });
}

// Returns the success rate over all tasks; -1 without a judged episode.
double Rate(const PlanReport& report, size_t policy) {
  const metrics::RunSummary& all = report.all.cells[policy].summary;
  return all.judged > 0 ? static_cast<double>(all.successes) / all.judged : -1.0;
}

// Returns the indices of the policies by descending success over all tasks.
std::vector<size_t> ByRate(const PlanReport& report) {
  std::vector<size_t> order(report.policies.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](size_t policy) { return Rate(report, policy); });
  return order;
}

std::string LettersOf(const PlanReport& report, const std::string& policy) {
  const auto ranked = std::ranges::find(report.ranking, policy, &results::RankedRun::name);
  return ranked == report.ranking.end() ? "" : ranked->letters;
}

// Writes a cell with the verdict against the baseline.
void VerdictCell(const PlanReport& report, const std::string& policy, Markup* html) {
  const auto verdict = std::ranges::find(report.verdicts, policy, &PlanVerdict::policy);
  html->Element("td", {{"class", "against"}, {"data-label", "against " + report.baseline}}, [&] {
    if (verdict == report.verdicts.end()) return html->Text(policy == report.baseline ? "baseline" : "-");
    const bool is_shown = !verdict->judgment.empty();
    html->Element("span", {{"class", is_shown ? verdict->judgment : "none"}},
                  is_shown ? verdict->judgment : "no difference shown");
    html->Element("div", {{"class", "note"}}, WithMinus(verdict->difference));
  });
}

// rank: not shown if the report has no ranking.
void PolicyRow(const PlanReport& report, size_t rank, size_t policy, Markup* html) {
  const std::string& name = report.policies[policy];
  const auto labeled = [&](const PlanCell& cell, const std::string& label) { Cell(cell, label, html); };
  html->Element("tr", {}, [&] {
    if (!report.ranking.empty()) {
      html->Element("td", {{"class", "number rank"}}, [&] {
        Data(static_cast<double>(rank), std::to_string(rank), html);
        if (const std::string letters = LettersOf(report, name); !letters.empty())
          html->Element("div", {{"class", "note"}}, letters);
      });
    }
    html->Element("th", {{"scope", "row"}}, [&] {
      if (policy >= report.reports.size()) return html->Text(name);
      html->Element("a", {{"href", report.reports[policy].url}}, name);
    });
    labeled(report.all.cells[policy], "all");
    VerdictCell(report, name, html);
    for (const PlanRow& task : report.tasks) labeled(task.cells[policy], task.name);
    if (report.tasks.size() < 2) return;
    html->Element("td", {{"class", "number"}, {"data-label", "mean of tasks"}},
                  [&] { Data(report.means[policy], Percent(report.means[policy]), html); });
  });
}

// Writes a task's name, with possible line breaks after "_" and "/".
void TaskTitle(const std::string& task, Markup* html) {
  html->Element("th", {{"class", "number"}}, [&] {
    for (size_t begin = 0; begin < task.size();) {
      const size_t end = std::min(task.find_first_of("_/", begin), task.size() - 1) + 1;
      if (begin > 0) html->Empty("wbr", {});
      html->Text(task.substr(begin, end - begin));
      begin = end;
    }
  });
}

void Rates(const PlanReport& report, Markup* html) {
  // The narrow style lets eight tasks fit on a page.
  const char* const kind = report.tasks.size() > 4 ? "sortable stacked narrow" : "sortable stacked";
  html->Element("h2", {{"id", "success"}}, "Success");
  const auto titles = [&] {
    if (!report.ranking.empty()) html->Element("th", {{"class", "number"}}, "rank");
    html->Element("th", {}, "policy");
    html->Element("th", {{"class", "number"}}, "all");
    html->Element("th", {}, "against " + report.baseline);
    for (const PlanRow& task : report.tasks) TaskTitle(task.name, html);
    if (report.tasks.size() > 1) html->Element("th", {{"class", "number"}}, "mean of tasks");
  };
  const auto rows = [&] {
    const std::vector<size_t> order = ByRate(report);
    size_t rank = 0;
    for (size_t i = 0; i < order.size(); ++i) {
      // Equal rates have equal ranks.
      if (i == 0 || Rate(report, order[i]) < Rate(report, order[i - 1])) rank = i + 1;
      PolicyRow(report, rank, order[i], html);
    }
  };
  ScrollingTable({{"class", kind}, {"id", "rates"}}, titles, rows, html);
  std::string note =
      "Share of the complete episodes that succeeded, with its 95 % interval (Wilson). A rate links to its "
      "run. An episode links to its playback in 3D: the first failure or, if no failure can be played, the "
      "first success.";
  if (!report.ranking.empty()) note += " " + results::RankingNote(report.ranking);
  html->Element("p", {{"class", "note"}}, note);
}

void Verdicts(const PlanReport& report, Markup* html) {
  if (report.verdicts.empty()) return;
  html->Element("h2", {{"id", "comparisons"}}, "Against " + report.baseline);
  if (!report.verdict_note.empty()) html->Element("p", {{"class", "note"}}, report.verdict_note);
  html->Element("ul", {{"class", "verdicts"}}, [&] {
    for (const PlanVerdict& verdict : report.verdicts) {
      html->Element("li", {}, [&] {
        html->Text(WithMinus(verdict.text) + " ");
        if (!verdict.url.empty()) html->Element("a", {{"href", verdict.url}}, "Comparison");
      });
    }
  });
}

void Failures(const PlanReport& report, Markup* html) {
  std::set<std::string> reasons;
  for (const PlanCell& all : report.all.cells) {
    for (const auto& [reason, count] : all.summary.failure_reasons) reasons.insert(reason);
  }
  if (reasons.empty()) return;
  html->Element("h2", {{"id", "failures"}}, "Failure reasons");
  const auto titles = [&] {
    html->Element("th", {}, "episodes that failed with");
    for (const std::string& policy : report.policies) html->Element("th", {{"class", "number"}}, policy);
  };
  const auto cell = [&](size_t policy, const std::string& reason) {
    double count = 0;
    for (const auto& [name, number] : report.all.cells[policy].summary.failure_reasons)
      count += name == reason ? number : 0;
    const auto& episodes = report.failed_episodes[policy];
    const auto episode = episodes.find(reason);
    if (episode == episodes.end()) return NumberCell(count, fmt::format("{:.0f}", count), html);
    html->Element("td", {{"class", "number"}}, [&] {
      html->Element("a", {{"href", episode->second}, {"title", "one of them in 3D"}},
                    [&] { Data(count, fmt::format("{:.0f}", count), html); });
    });
  };
  const auto rows = [&] {
    for (const std::string& reason : reasons) {
      html->Element("tr", {}, [&] {
        html->Element("th", {{"scope", "row"}}, end_reason::Text(reason));
        for (size_t policy = 0; policy < report.all.cells.size(); ++policy) cell(policy, reason);
      });
    }
  };
  ScrollingTable({{"class", "sortable"}}, titles, rows, html);
}

// Returns the number of judged episodes of each policy and task, for example "20 episodes each". A plan can
// stop policies early.
std::string EpisodesOfEach(const PlanReport& report) {
  int least = std::numeric_limits<int>::max(), most = 0;
  for (const PlanRow& task : report.tasks) {
    for (const PlanCell& cell : task.cells) {
      least = std::min(least, cell.summary.judged);
      most = std::max(most, cell.summary.judged);
    }
  }
  if (most == 0) return "no episodes";
  return least == most ? Plural(most, "episode") + " each"
                       : fmt::format("{} to {} episodes each", least, most);
}

}  // namespace

std::string PlanPage(const PlanReport& report, const std::string& made_by) {
  const std::string heading = report.verdict.empty() ? report.title : WithMinus(report.verdict);
  return Page(heading, made_by, {{"page", kPlanPage}}, [&](Markup* html) {
    html->Element("p", {{"class", "subtitle"}}, [&] {
      if (!report.verdict.empty()) html->Text(report.title + ": ");
      html->Text(fmt::format(
          "{} on {}, {}.",
          report.policies.size() == 1 ? "1 policy" : fmt::format("{} policies", report.policies.size()),
          Plural(report.tasks.size(), "task"), EpisodesOfEach(report)));
    });
    Rates(report, html);
    for (const std::string& remark : report.remarks) html->Element("p", {{"class", "note"}}, remark);
    Verdicts(report, html);
    Failures(report, html);
  });
}

}  // namespace evalbus::report
