#include "report/page/comparison_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

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

double Rate(int successes, int trials) {
  return trials > 0 ? static_cast<double>(successes) / trials : std::numeric_limits<double>::quiet_NaN();
}

// A row of a table. A value that is not finite is unavailable.
struct Row {
  std::string name, unit;
  double baseline = 0, run = 0, difference = 0;
  metrics::Interval difference_95{};
  double p = 0, p_adjusted = 0;
  std::string judgment;

  // Largest absolute value of the interval's ends. The largest one of several rows is their common scale.
  double Bound() const { return std::max(std::abs(difference_95.lower), std::abs(difference_95.upper)); }
};

// Success rates as shares from 0 to 1.
Row SuccessRow(const std::string& name, const results::SuccessComparison& success) {
  return {.name = name,
          .unit = "",
          .baseline = Rate(success.baseline_successes, success.baseline_trials),
          .run = Rate(success.successes, success.trials),
          .difference = success.difference,
          .difference_95 = success.difference_95,
          .p = success.p,
          .p_adjusted = success.p_adjusted,
          .judgment = results::Word(success.judgment())};
}

// In the unit that is shown.
Row MetricRow(const results::MetricComparison& metric) {
  const double scale = metric.number.scale();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  return {.name = metric.number.label() + (metric.number.metric->effort ? " *" : ""),
          .unit = std::string(metric.number.shown_unit()),
          .baseline = metric.baseline_mean * scale,
          .run = metric.mean * scale,
          .difference = metric.difference * scale,
          .difference_95 = {metric.difference_95.lower * scale, metric.difference_95.upper * scale},
          .p = metric.p.value_or(kNaN),
          .p_adjusted = metric.p ? metric.p_holm : kNaN,
          .judgment = results::Word(metric.judgment())};
}

void Write(const Row& row, double bound, bool shares, Markup* html) {
  const double scale = shares ? 100 : 1;
  const double lower = row.difference_95.lower, upper = row.difference_95.upper;
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
      if (std::isfinite(lower) && bound > 0) {
        DrawDifference(row.difference / bound, lower / bound, upper / bound, ClassOf(row.judgment), html);
      }
    });
    html->Element("td", {{"class", "number"}}, [&] {
      if (!std::isfinite(lower)) return html->Text("-");
      html->Text(shares ? Fixed(lower * scale, 0) + " to " + Fixed(upper * scale, 0)
                        : Number(lower, 3) + " to " + Number(upper, 3));
    });
    NumberCell(row.p, P(row.p), html);
    NumberCell(row.p_adjusted, P(row.p_adjusted), html);
    html->Element("td", {{"class", ClassOf(row.judgment)}}, row.judgment);
  });
}

std::string Title(const results::ComparedRuns& runs) {
  return fmt::format("{} ({})", runs.name, runs.policy);
}

void Table(const results::Comparison& comparison, const std::string& what, const std::function<void()>& rows,
           Markup* html) {
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, what);
          html->Element("th", {{"class", "number"}}, Title(comparison.baseline));
          html->Element("th", {{"class", "number"}}, Title(comparison.run));
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

// One run's cell for a flipped pair: episode, outcome, videos. failure_reason: empty if it succeeded.
void FlipCell(int episode, const std::string& failure_reason, const std::vector<ReportLink>& videos,
              Markup* html) {
  const bool success = failure_reason.empty();
  html->Element("td", {{"class", "files"}}, [&] {
    html->Element("span", {{"class", success ? "sign good" : "sign bad"}}, success ? "✓" : "✗");
    html->Text(fmt::format(" episode {}{} ", episode, success ? "" : ": " + failure_reason));
    Links(videos, html);
  });
}

void Flips(const ComparisonPageParts& parts, const results::Comparison& comparison,
           const results::TaskComparison& task, Markup* html) {
  if (task.flipped.empty()) return;
  bool any_video = false;
  html->Element("h4", {}, Plural(task.flipped.size(), "seed") + " with success on one side only");
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          html->Element("th", {}, Title(comparison.baseline));
          html->Element("th", {}, Title(comparison.run));
          html->Element("th", {{"class", "number"}}, "seed");
        });
      });
      html->Element("tbody", {}, [&] {
        for (const results::FlippedPair& pair : task.flipped) {
          const auto baseline_videos = parts.videos(task.baseline_folder, pair.baseline_episode);
          const auto videos = parts.videos(task.folder, pair.episode);
          any_video = any_video || !baseline_videos.empty() || !videos.empty();
          html->Element("tr", {}, [&] {
            FlipCell(pair.baseline_episode, pair.success ? pair.failure_reason : "", baseline_videos, html);
            FlipCell(pair.episode, pair.success ? "" : pair.failure_reason, videos, html);
            html->Element("td", {{"class", "number seed"}}, std::to_string(pair.seed));
          });
        }
      });
    });
  });
  if (any_video) return;
  html->Element(
      "p", {{"class", "note"}},
      "There are no videos of these: evalbus render RUN --episode N makes them; run evalbus compare "
      "--report again to link them here.");
}

void Write(const ComparisonPageParts& parts, const results::Comparison& comparison, Markup* html) {
  html->Element("p", {{"class", "verdict"}}, results::Conclusion(comparison));
  Table(
      comparison, "success, %",
      [&] {
        for (const results::TaskComparison& task : comparison.tasks) {
          Write(SuccessRow(task.name(), task.success), 1, true, html);
        }
        if (comparison.tasks.size() > 1) Write(SuccessRow("all", comparison.success), 1, true, html);
      },
      html);
  for (const results::TaskComparison& task : comparison.tasks) {
    html->Element("h3", {}, task.name());
    html->Element("p", {{"class", "note"}}, results::WhatIsCounted(task));
    Table(
        comparison, "metric",
        [&] {
          for (const results::MetricComparison& metric : task.metrics) {
            const Row row = MetricRow(metric);
            Write(row, row.Bound(), false, html);
          }
        },
        html);
    Flips(parts, comparison, task, html);
  }
  const auto note = [&](const std::string& text) { html->Element("p", {{"class", "note"}}, text); };
  for (const std::string& remark : comparison.remarks) note(remark);
  note(
      fmt::format("p of success: {}. Adjusted p: adjusted for the number of tests in a table. {} Each "
                  "interval has its own scale.",
                  results::TestName(comparison.success.test), results::kIntervalsAreSingle));
}

}  // namespace

std::string ComparisonPage(const ComparisonPageParts& parts) {
  const auto content = [&](Markup* html) {
    for (const results::Comparison& comparison : parts.comparisons) {
      html->Element("h2", {}, Title(comparison.run) + " against " + Title(comparison.baseline));
      Write(parts, comparison, html);
      if (&comparison != &parts.comparisons.front()) continue;
      for (const std::string& note : parts.viewer_notes) html->Element("p", {{"class", "note"}}, note);
    }
    if (parts.viewer) WriteViewer(*parts.viewer, html);
  };
  return Page("Comparison with " + Title(parts.comparisons.front().baseline), parts.made_by, content,
              parts.viewer ? &*parts.viewer : nullptr);
}

}  // namespace evalbus::report
