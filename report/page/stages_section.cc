#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "base/text.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"

namespace evalbus::report {
namespace {

void Heading(const RunSection& section, const std::string& text, const std::string& id,
             const std::string& note) {
  section.html->Element(section.heading, {{"id", section.id + id}}, text);
  section.html->Element("p", {{"class", "note"}}, note);
}

// Writes a table with one row per element of `rows`, written by `write`.
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
  const auto row = [&](const ReportStage& stage) {
    const double share = section.run.complete > 0 ? static_cast<double>(stage.reached) / section.run.complete
                                                  : std::numeric_limits<double>::quiet_NaN();
    html->Element("th", {{"scope", "row"}},
                  stage.name.empty() ? "stage " + stage.index : stage.index + " " + Words(stage.name));
    html->Element("td", {{"class", "bar"}}, [&] {
      if (std::isfinite(share)) DrawBar(share, "good", html);
    });
    NumberCell(share, Percent(share), html);
    NumberCell(stage.median_time, fmt::format("{:.2f} s", stage.median_time), html);
  };
  BarTable(section.run.stages, row, html);
}

void Counts(const ReportCounts& counts, Markup* html) {
  double sum = 0;
  for (const auto& [name, count] : counts) sum += static_cast<double>(count);
  const auto row = [&](const std::pair<std::string, int64_t>& entry) {
    const auto count = static_cast<double>(entry.second);
    html->Element("th", {{"scope", "row"}}, entry.first);
    html->Element("td", {{"class", "bar"}}, [&] { DrawBar(count / sum, "bad", html); });
    NumberCell(count, html);
  };
  BarTable(counts, row, html);
}

void FailureReasons(const RunSection& section) {
  Heading(section, "Failure reasons", "failures", "Complete episodes without success, by reason.");
  Counts(section.run.failure_reasons, section.html);
}

void Collisions(const RunSection& section) {
  Heading(section, "Collisions", "collisions",
          "New collisions in all complete episodes, by the touched geom.");
  Counts(section.run.collisions, section.html);
}

}  // namespace

void WriteStages(const RunSection& section) {
  const ReportRun& run = section.run;
  if (run.stages.empty() && run.failure_reasons.empty() && run.collisions.empty()) return;
  Markup* html = section.html;
  html->Element("section", {{"class", "columns"}}, [&] {
    if (!run.stages.empty()) html->Element("div", {}, [&] { StageTable(section); });
    if (!run.failure_reasons.empty()) html->Element("div", {}, [&] { FailureReasons(section); });
    if (!run.collisions.empty()) html->Element("div", {}, [&] { Collisions(section); });
  });
}

void WriteMade(const RunSection& section) {
  Markup* html = section.html;
  const auto row = [&](const std::pair<std::string, std::string>& made) {
    html->Element("tr", {}, [&] {
      html->Element("th", {{"scope", "row"}}, made.first);
      html->Element("td", {}, made.second);
    });
  };
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "made"}}, "How it was made");
    html->Element("table", {{"class", "made"}}, [&] {
      html->Element("tbody", {}, [&] {
        for (const auto& made : section.run.made) row(made);
      });
    });
  });
}

}  // namespace evalbus::report
