#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"

namespace evalbus::report {
namespace {

void Heading(const RunSection& section, const std::string& text, const std::string& id,
             const std::string& note) {
  section.html->Element(section.heading, {{"id", section.id + id}}, text);
  section.html->Element("p", {{"class", "note"}}, note);
}

// Writes a table in which write() writes one row per element of `rows`.
template <class Rows, class Write>
void BarTable(const Rows& rows, Write write, Markup* html) {
  html->Element("table", {{"class", "bars"}}, [&] {
    html->Element("tbody", {}, [&] {
      for (const auto& row : rows) html->Element("tr", {}, [&] { write(row); });
    });
  });
}

void StageTable(const RunSection& section) {
  Markup* html = section.html;
  Heading(section, "Stages", "stages",
          "Complete episodes that reached each stage, in any order, and the median time at which they did.");
  const ReportRun& run = section.run;
  if (const std::string text = run.summary.StagesText(); !text.empty())
    html->Element("p", {{"class", "note"}}, text + ".");
  const auto row = [&](const metrics::StageSummary& stage) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const double share =
        run.summary.complete > 0 ? static_cast<double>(stage.reached) / run.summary.complete : kNaN;
    const std::string index = std::to_string(stage.index);
    const auto name = run.stage_name.find(stage.index);
    const bool is_named = name != run.stage_name.end() && !name->second.empty();
    html->Element("th", {{"scope", "row"}}, is_named ? index + " " + Words(name->second) : "stage " + index);
    html->Element("td", {{"class", "bar"}}, [&] {
      if (std::isfinite(share)) DrawBar(share, "good", html);
    });
    NumberCell(share, Percent(share), html);
    const metrics::MetricSummary* const time = run.summary.Find("extended.stage_time_s." + index);
    const double median = time ? time->median : kNaN;
    NumberCell(median, fmt::format("{:.2f} s", median), html);
  };
  BarTable(run.summary.stages, row, html);
}

template <class Count>
void Counts(const std::vector<std::pair<std::string, Count>>& counts, Markup* html) {
  double sum = 0;
  for (const auto& [name, count] : counts) sum += static_cast<double>(count);
  const auto row = [&](const std::pair<std::string, Count>& entry) {
    const auto count = static_cast<double>(entry.second);
    html->Element("th", {{"scope", "row"}}, entry.first);
    html->Element("td", {{"class", "bar"}}, [&] { DrawBar(count / sum, "bad", html); });
    NumberCell(count, html);
  };
  BarTable(counts, row, html);
}

void FailureReasons(const RunSection& section) {
  Heading(section, "Failure reasons", "failures", "Complete episodes without success, by reason.");
  std::vector<std::pair<std::string, int>> counts = FailureReasonsOf(section.run.summary);
  for (auto& [reason, count] : counts) reason = end_reason::Text(reason);
  Counts(counts, section.html);
}

void Collisions(const RunSection& section) {
  Heading(section, "Collisions", "collisions",
          "New collisions in all complete episodes, by the touched geom.");
  Counts(section.run.summary.collisions_per_geom, section.html);
}

}  // namespace

void WriteStages(const RunSection& section) {
  const metrics::RunSummary& summary = section.run.summary;
  const bool has_failures = !FailureReasonsOf(summary).empty();
  if (summary.stages.empty() && !has_failures && summary.collisions_per_geom.empty()) return;
  Markup* html = section.html;
  html->Element("section", {{"class", "columns"}}, [&] {
    if (!summary.stages.empty()) html->Element("div", {}, [&] { StageTable(section); });
    if (has_failures) html->Element("div", {}, [&] { FailureReasons(section); });
    if (!summary.collisions_per_geom.empty()) html->Element("div", {}, [&] { Collisions(section); });
  });
}

}  // namespace evalbus::report
