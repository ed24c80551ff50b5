#include "report/page/comparison_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/plural.h"
#include "base/text.h"
#include "report/page/figures.h"
#include "report/page/page.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

std::string ClassOf(const std::string& judgment) { return judgment.empty() ? "none" : judgment; }

std::string P(double p) {
  return !std::isfinite(p) ? "-" : p < 0.001 ? std::string("< 0.001") : fmt::format("{:.3f}", p);
}

// Returns the largest absolute value of an interval's ends. The maximum over rows of one unit is their common
// scale.
double Bound(const ReportDifference& row) { return std::max(std::abs(row.lower), std::abs(row.upper)); }

void Row(const ReportDifference& row, double bound, bool shares, Markup* html) {
  const double scale = shares ? 100 : 1;
  const auto number = [&](double value) {
    NumberCell(value, shares && std::isfinite(value) ? Fixed(value * scale, 0) : Number(value), html);
  };
  html->Element("tr", {{"data-metric", row.name}}, [&] {
    html->Element("th", {{"scope", "row"}}, [&] {
      html->Text(row.name);
      if (!row.unit.empty()) html->Element("span", {{"class", "unit"}}, ", " + row.unit);
    });
    number(row.baseline);
    number(row.run);
    number(row.difference);
    html->Element("td", {{"class", "bar"}}, [&] {
      if (std::isfinite(row.lower) && bound > 0) {
        DrawDifference(row.difference / bound, row.lower / bound, row.upper / bound, ClassOf(row.judgment),
                       html);
      }
    });
    html->Element("td", {{"class", "number"}}, [&] {
      if (!std::isfinite(row.lower)) return html->Text("-");
      html->Text(shares ? Fixed(row.lower * scale, 0) + " to " + Fixed(row.upper * scale, 0)
                        : Number(row.lower, 3) + " to " + Number(row.upper, 3));
    });
    NumberCell(row.p, P(row.p), html);
    NumberCell(row.p_holm, P(row.p_holm), html);
    html->Element("td", {{"class", ClassOf(row.judgment)}}, row.judgment);
  });
}

void Table(const ReportComparison& comparison, const std::string& what, const std::function<void()>& rows,
           Markup* html) {
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, what);
          html->Element("th", {{"class", "number"}}, comparison.baseline);
          html->Element("th", {{"class", "number"}}, comparison.run);
          html->Element("th", {{"class", "number"}}, "difference");
          html->Element("th", {{"class", "unsorted"}}, "its 95 % interval, around 0");
          html->Element("th", {{"class", "unsorted"}}, "");
          html->Element("th", {{"class", "number"}}, "p");
          html->Element("th", {{"class", "number"}}, "p, adjusted");
          html->Element("th", {}, "");
        });
      });
      html->Element("tbody", {}, rows);
    });
  });
}

// One run's cell for a flipped pair: episode, outcome, videos.
void FlipCell(int episode, const std::string& end, const std::vector<ReportLink>& videos, Markup* html) {
  const bool success = end.empty();
  html->Element("td", {{"class", "files"}}, [&] {
    html->Element("span", {{"class", success ? "sign good" : "sign bad"}}, success ? "✓" : "✗");
    html->Text(fmt::format(" episode {}{} ", episode, success ? "" : ": " + end));
    Links(videos, html);
  });
}

void Flips(const ReportComparison& comparison, const ReportTaskComparison& task, Markup* html) {
  if (task.flips.empty()) return;
  html->Element("h4", {}, Plural(task.flips.size(), "seed") + " with success on one side only");
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, comparison.baseline);
          html->Element("th", {}, comparison.run);
          html->Element("th", {{"class", "number"}}, "seed");
        });
      });
      html->Element("tbody", {}, [&] {
        for (const ReportFlip& flip : task.flips) {
          html->Element("tr", {}, [&] {
            FlipCell(flip.baseline_episode, flip.baseline, flip.baseline_videos, html);
            FlipCell(flip.run_episode, flip.run, flip.run_videos, html);
            html->Element("td", {{"class", "number seed"}}, std::to_string(flip.seed));
          });
        }
      });
    });
  });
  if (!task.video_hint.empty()) html->Element("p", {{"class", "note"}}, task.video_hint);
}

void Write(const ReportComparison& comparison, Markup* html) {
  html->Element("p", {{"class", "verdict"}}, comparison.verdict);
  Table(
      comparison, "success, %",
      [&] {
        for (const ReportTaskComparison& task : comparison.tasks) Row(task.success, 1, true, html);
        if (comparison.tasks.size() > 1) Row(comparison.success, 1, true, html);
      },
      html);
  for (const ReportTaskComparison& task : comparison.tasks) {
    html->Element("h3", {}, task.task);
    html->Element("p", {{"class", "note"}}, task.counts);
    Table(
        comparison, "metric",
        [&] {
          for (const ReportDifference& metric : task.metrics) Row(metric, Bound(metric), false, html);
        },
        html);
    Flips(comparison, task, html);
  }
  for (const std::string& note : comparison.notes) html->Element("p", {{"class", "note"}}, note);
}

}  // namespace

std::string ComparisonPage(const std::string& title, const std::vector<ReportComparison>& comparisons,
                           const std::string& made_by, const std::optional<viz::PackedViewer>& viewer) {
  const auto content = [&](Markup* html) {
    for (const ReportComparison& comparison : comparisons) {
      html->Element("h2", {}, comparison.run + " against " + comparison.baseline);
      Write(comparison, html);
    }
    if (viewer) WriteViewer(*viewer, html);
  };
  return Page(title, made_by, content, viewer ? &*viewer : nullptr);
}

}  // namespace evalbus::report
