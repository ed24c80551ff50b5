#include "report/page/plan_page.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>

#include "base/percent.h"
#include "base/plural.h"
#include "base/text.h"
#include "report/page/figures.h"

namespace evalbus::report {
namespace {

void Cell(const PlanCell& cell, Markup* html) {
  const metrics::RunSummary& summary = cell.summary;
  if (summary.judged == 0) return html->Element("td", {{"class", "number"}}, "-");
  const double rate = summary.success_rate;
  html->Element("td", {{"class", "number share"}}, [&] {
    const std::string text = Percent(rate);
    if (cell.url.empty()) {
      Data(rate, text, html);
    } else {
      html->Element("a", {{"href", cell.url}}, [&] { Data(rate, text, html); });
    }
    html->Element("div", {},
                  [&] { DrawShare(rate, summary.wilson.lower, summary.wilson.upper, false, html); });
    html->Element("div", {{"class", "note"}}, [&] {
      html->Text(fmt::format("{} of {}", summary.successes, summary.judged));
      if (cell.episodes.empty()) return;
      html->Text("; ");
      Links(cell.episodes, html);
    });
  });
}

void Row(const PlanRow& row, Markup* html) {
  html->Element("tr", {}, [&] {
    html->Element("th", {{"scope", "row"}}, row.name);
    for (const PlanCell& cell : row.cells) Cell(cell, html);
  });
}

void PolicyTitles(const PlanReport& report, Markup* html) {
  for (const std::string& policy : report.policies) html->Element("th", {{"class", "number"}}, policy);
}

void Rates(const PlanReport& report, Markup* html) {
  html->Element("h2", {{"id", "success"}}, "Success");
  html->Element("p", {{"class", "note"}},
                "Share of the complete episodes that succeeded, with its 95 % interval (Wilson). A rate "
                "links to its run, an episode to its motion in 3D: the first failure, if there is one.");
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}, {"id", "rates"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, "task");
          PolicyTitles(report, html);
        });
      });
      html->Element("tbody", {}, [&] {
        for (const PlanRow& task : report.tasks) Row(task, html);
      });
      if (report.tasks.size() < 2) return;
      html->Element("tfoot", {}, [&] {
        Row(report.all, html);
        html->Element("tr", {}, [&] {
          html->Element("th", {{"scope", "row"}}, "mean of the tasks' rates");
          for (const double mean : report.means) NumberCell(mean, Percent(mean), html);
        });
      });
    });
  });
}

void Verdicts(const PlanReport& report, Markup* html) {
  if (report.verdicts.empty()) return;
  html->Element("h2", {{"id", "comparisons"}}, "Against " + report.baseline);
  html->Element("p", {{"class", "note"}}, report.verdict_note);
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {}, [&] {
      html->Element("tbody", {}, [&] {
        for (const PlanVerdict& verdict : report.verdicts) {
          html->Element("tr", {}, [&] {
            html->Element("th", {{"scope", "row"}}, [&] {
              if (verdict.url.empty()) return html->Text(verdict.policy);
              html->Element("a", {{"href", verdict.url}}, verdict.policy);
            });
            html->Element("td", {{"class", verdict.judgment.empty() ? "none" : verdict.judgment}},
                          verdict.judgment.empty() ? "no difference shown" : verdict.judgment);
            NumberCell(verdict.p, verdict.p < 0.001 ? "p < 0.001" : fmt::format("p = {:.3f}", verdict.p),
                       html);
            html->Element("td", {}, verdict.text);
          });
        }
      });
    });
  });
}

void Ranking(const PlanReport& report, Markup* html) {
  if (report.ranking.empty()) return;
  html->Element("h2", {{"id", "ranking"}}, "Ranking by success");
  html->Element("p", {{"class", "note"}}, results::kRankingNote);
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {}, [&] {
      html->Element("tbody", {}, [&] {
        for (const results::RankedRun& rank : report.ranking) {
          const double rate = rank.trials > 0 ? static_cast<double>(rank.successes) / rank.trials
                                              : std::numeric_limits<double>::quiet_NaN();
          html->Element("tr", {}, [&] {
            html->Element("th", {{"scope", "row"}}, rank.name);
            html->Element("td", {{"class", "number"}}, fmt::format("{} of {}", rank.successes, rank.trials));
            NumberCell(rate, Percent(rate), html);
            html->Element("td", {}, rank.letters);
          });
        }
      });
    });
  });
}

void Failures(const PlanReport& report, Markup* html) {
  std::set<std::string> reasons;
  for (const PlanCell& all : report.all.cells) {
    for (const auto& [reason, count] : all.summary.failure_reasons) reasons.insert(reason);
  }
  if (reasons.empty()) return;
  html->Element("h2", {{"id", "failures"}}, "Failure reasons");
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, "episodes that failed with");
          PolicyTitles(report, html);
        });
      });
      html->Element("tbody", {}, [&] {
        for (const std::string& reason : reasons) {
          html->Element("tr", {}, [&] {
            html->Element("th", {{"scope", "row"}}, reason);
            for (size_t policy = 0; policy < report.all.cells.size(); ++policy) {
              double count = 0;
              for (const auto& [name, number] : report.all.cells[policy].summary.failure_reasons)
                count += name == reason ? number : 0;
              const auto& episodes = report.failed_episodes[policy];
              const auto episode = episodes.find(reason);
              if (episode == episodes.end()) {
                NumberCell(count, fmt::format("{:.0f}", count), html);
                continue;
              }
              html->Element("td", {{"class", "number"}}, [&] {
                html->Element("a", {{"href", episode->second}, {"title", "one of them in 3D"}},
                              [&] { Data(count, fmt::format("{:.0f}", count), html); });
              });
            }
          });
        }
      });
    });
  });
}

}  // namespace

std::string PlanPage(const PlanReport& report, const std::string& made_by) {
  return Page(report.title, made_by, [&](Markup* html) {
    html->Element("p", {{"class", "subtitle"}}, [&] {
      html->Text(fmt::format(
          "{} on {}, {} each. Reports: ",
          report.policies.size() == 1 ? "1 policy" : fmt::format("{} policies", report.policies.size()),
          Plural(report.tasks.size(), "task"),
          report.tasks.empty() || report.tasks[0].cells.empty()
              ? "no episodes"
              : Plural(report.tasks[0].cells[0].summary.judged, "episode")));
      Links(report.reports, html);
    });
    for (const std::string& remark : report.remarks) html->Element("p", {{"class", "note"}}, remark);
    Rates(report, html);
    Verdicts(report, html);
    Ranking(report, html);
    Failures(report, html);
  });
}

}  // namespace evalbus::report
