#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"
#include "results/pacing.h"
#include "results/summary_table.h"

namespace evalbus::report {
namespace {

// Returns e.g. "19 of 20 episodes succeeded: 95 % (95 % interval 76 to 99 %, Wilson)."
std::string RateSentence(const metrics::RunSummary& summary) {
  if (summary.complete == 0) return "No episode is complete, so there is no success rate.";
  if (summary.judged == 0) return "Success could not be determined: poses of objects are missing.";
  const char* const kind = summary.judged < summary.complete     ? "judged episode"
                           : summary.complete < summary.episodes ? "complete episode"
                                                                 : "episode";
  return fmt::format("{} of {} succeeded: {} (95 % interval {}, Wilson).", summary.successes,
                     Plural(summary.judged, kind), Percent(summary.success_rate),
                     results::PercentText(summary.wilson));
}

std::string FailureSentence(const metrics::RunSummary& summary) {
  std::string list;
  for (const auto& [reason, count] : FailureReasonsOf(summary)) {
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", end_reason::Text(reason), count);
  }
  std::string text = list.empty() ? "" : "Failures: " + list + ".";
  if (const int others = summary.complete - summary.judged; others > 0)
    text += fmt::format("{}Not judged: {}.", text.empty() ? "" : " ", Plural(others, "episode"));
  return text;
}

// Draws the failure reasons as bars, the most frequent first.
void FailureBars(const metrics::RunSummary& summary, Markup* html) {
  const auto reasons = FailureReasonsOf(summary);
  if (reasons.empty()) return;
  html->Element("table", {{"class", "bars"}}, [&] {
    html->Element("tbody", {}, [&] {
      for (const auto& [reason, count] : reasons) {
        html->Element("tr", {}, [&] {
          html->Element("th", {{"scope", "row"}}, end_reason::Text(reason));
          html->Element("td", {{"class", "bar"}}, [&, count = count] {
            DrawBar(static_cast<double>(count) / summary.complete, "bad", html);
          });
          NumberCell(count, html);
        });
      }
    });
  });
}

void RateTile(const RunSection& section) {
  Markup* html = section.html;
  const metrics::RunSummary& summary = section.run.summary;
  const double rate = summary.success_rate;
  html->Element("div", {{"class", "tile wide"}}, [&] {
    html->Element("div", {{"class", "label"}}, "success rate");
    html->Element("div", {{"class", "value"}, {"id", section.id + "success-rate"}},
                  [&] { Data(rate, Percent(rate), html); });
    if (std::isfinite(rate)) DrawShare(rate, summary.wilson.lower, summary.wilson.upper, true, html);
    FailureBars(summary, html);
  });
}

void MetricTile(const metrics::MetricSummary& metric, Markup* html) {
  const MetricNumber number = FindMetric(metric.name);
  const std::string unit(number.shown_unit());
  // Formats values with as many digits as the table in the terminal.
  const auto text = [&](double value) {
    return ShownValue(*number.metric, value, metric.std / std::sqrt(metric.episodes));
  };
  const bool is_of_successes = IsOfSuccessesOnly(metric.name);
  html->Element("div", {{"class", "tile"}}, [&] {
    html->Element("div", {{"class", "label"}},
                  is_of_successes ? "mean time to success" : "mean " + number.label());
    html->Element("div", {{"class", "value"}}, [&] {
      Data(metric.mean, text(metric.mean), html);
      if (!unit.empty()) html->Element("span", {{"class", "unit"}}, " " + unit);
    });
    html->Element("div", {{"class", "note"}},
                  (is_of_successes ? (metric.episodes == 1 ? std::string("1 success")
                                                           : fmt::format("{} successes", metric.episodes)) +
                                         ", "
                                   : "") +
                      "median " + WithMinus(text(metric.median)) + ", max " + WithMinus(text(metric.max)));
  });
}

// Shows the success rate and up to six metrics: first metrics that vary, then constant ones.
void Tiles(const RunSection& section) {
  constexpr size_t kTiles = 6;
  std::vector<const metrics::MetricSummary*> varying, constant;
  for (const char* name : {"completion_time", "subtask_progress", "slip_count", "env_collision_count",
                           "self_collision_count", "extended.min_clearance_m", "total_cartesian_path_length",
                           "cartesian_path_length", "overall_rms_cartesian_jerk"}) {
    const auto* metric = section.run.summary.Find(name);
    if (metric) (metric->min < metric->max ? varying : constant).push_back(metric);
  }
  varying.insert(varying.end(), constant.begin(), constant.end());
  varying.resize(std::min(varying.size(), kTiles));
  section.html->Element("div", {{"class", "tiles"}}, [&] {
    RateTile(section);
    for (const metrics::MetricSummary* metric : varying) MetricTile(*metric, section.html);
  });
}

// Writes one square per episode, in order, as a link to its table row.
void Strip(const RunSection& section) {
  const ReportRun& run = section.run;
  Markup* html = section.html;
  std::vector<std::vector<StripCell>> columns;
  for (const results::RecordedEpisode& episode : run.run.episodes) {
    const std::string& reason = episode.failure_reason.empty() ? episode.end_reason : episode.failure_reason;
    columns.push_back({{.css_class = Outcome(episode),
                        .text = std::to_string(episode.episode),
                        .title = fmt::format("episode {}: {}{}", episode.episode, end_reason::Text(reason),
                                             episode.complete ? "" : ", not complete"),
                        .url = "#" + EpisodeId(section, episode)}});
  }
  WriteStrip(columns, html);
  html->Element("p", {{"class", "legend"}}, [&] {
    LegendKey("good", "success", html);
    LegendKey("bad", "no success", html);
    if (run.summary.complete < run.summary.episodes) LegendKey("incomplete", "not complete", html);
    if (run.summary.judged < run.summary.complete) LegendKey("incomplete", "not judged", html);
    if (const size_t size = ColumnsPerSquare(columns.size()); size > 1) {
      html->Text(fmt::format("{} episodes per square", size));
    }
  });
}

void TimesTable(const RunSection& section) {
  Markup* html = section.html;
  html->Element("p", {},
                results::PacingSentence(section.run.pacing) + " Each time is the maximum over the episodes:");
  html->Element("table", {{"id", section.id + "times"}}, [&] {
    html->Element("tr", {}, [&] {
      html->Element("th", {}, "real time, ms");
      for (const char* heading : {"p50", "p99", "p99.9", "max"}) {
        html->Element("th", {{"class", "number"}}, heading);
      }
    });
    for (const results::PacingTimes& times : results::kPacingTimes) {
      html->Element("tr", {}, [&] {
        html->Element("td", {}, times.name);
        for (const char* percentile : {"p50_s", "p99_s", "p999_s", "max_s"}) {
          const double seconds = section.run.pacing[times.key][percentile];
          html->Element("td", {{"class", "number"}},
                        [&] { Data(seconds, fmt::format("{:.2f}", seconds * 1e3), html); });
        }
      });
    }
  });
}

}  // namespace

void WriteSummary(const RunSection& section) {
  const ReportRun& run = section.run;
  Markup* html = section.html;
  html->Element("p", {{"class", "verdict"}}, RateSentence(run.summary));
  if (const std::string text = FailureSentence(run.summary); !text.empty()) html->Element("p", {}, text);
  for (const std::string& remark : run.remarks)
    html->Element("p", {{"class", "warning"}}, Capitalized(remark));
  for (const std::string& remark : run.image_remarks)
    html->Element("p", {{"class", "warning"}, {kUnchecked, ""}}, remark);
  for (const std::string& note : run.notes) html->Element("p", {}, note);
  if (const std::string text = results::RepeatabilityText(run.summary); !text.empty()) {
    html->Element("p", {{"class", "note"}}, text + ".");
  }
  Tiles(section);
  Strip(section);
  if (!run.pacing.is_null()) TimesTable(section);
}

void WriteOperators(const RunSection& section) {
  if (section.run.operators.empty()) return;
  section.html->Element("section", {{kUnchecked, ""}}, [&] {
    section.html->Element(section.heading, {{"id", section.id + "operators"}}, "Verdicts of operators");
    for (const std::string& sentence : section.run.operators) section.html->Element("p", {}, sentence);
  });
}

}  // namespace evalbus::report
