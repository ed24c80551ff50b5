#include "report/page/report_page.h"

#include <fmt/format.h>

#include <cmath>

#include "base/text.h"
#include "report/page/report_sections.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

void Subtitle(const ReportRun& run, Markup* html) {
  html->Element("p", {{"class", "subtitle"}}, [&] {
    html->Text("policy ");
    html->Element("b", {}, run.run.policy);
    html->Text(", " + Plural(run.summary.episodes, "episode") + ", run " + run.run.name);
    if (const std::string engine = run.run.engine(); !engine.empty()) html->Text(", MuJoCo " + engine);
  });
}

std::string Id(size_t run) { return fmt::format("run-{}-", run); }

void SuiteTitles(Markup* html) {
  for (const char* title : {"task", "variation", "policy"}) html->Element("th", {}, title);
  html->Element("th", {{"class", "number"}}, "episodes");
  html->Element("th", {{"class", "number"}}, "success");
  html->Element("th", {{"class", "unsorted"}}, "95 % interval");
  for (const char* title : {"success time, s", "progress", "slips", "collisions"}) {
    html->Element("th", {{"class", "number"}}, title);
  }
}

void SuiteRow(const ReportRun& run, const std::string& id, Markup* html) {
  const metrics::RunSummary& summary = run.summary;
  const double rate = summary.success_rate;
  html->Element("th", {{"scope", "row"}}, [&] { html->Element("a", {{"href", "#" + id}}, run.run.task); });
  html->Element("td", {}, run.run.variation);
  html->Element("td", {}, run.run.policy);
  NumberCell(summary.complete,
             summary.complete == summary.episodes
                 ? Number(summary.episodes)
                 : fmt::format("{} of {}", summary.complete, summary.episodes),
             html);
  NumberCell(rate, Percent(rate), html);
  html->Element("td", {{"class", "bar"}}, [&] {
    if (std::isfinite(rate)) DrawShare(rate, summary.wilson.lower, summary.wilson.upper, false, html);
  });
  const auto mean = [&](const char* name) { return MeanOf(run, name); };
  const auto cell = [&](double value) {
    NumberCell(value, value == 0 ? "0" : fmt::format("{:.2f}", value), html);
  };
  cell(mean("completion_time"));
  NumberCell(mean("subtask_progress"), Percent(mean("subtask_progress")), html);
  cell(mean("slip_count"));
  cell(mean("env_collision_count") + mean("self_collision_count"));
}

void SuiteTable(const Report& report, Markup* html) {
  const auto rows = [&] {
    for (size_t i = 0; i < report.runs.size(); ++i) {
      html->Element("tr", {}, [&] { SuiteRow(report.runs[i], Id(i), html); });
    }
  };
  ScrollingTable(
      {{"class", "sortable"}, {"id", "suite"}}, [&] { SuiteTitles(html); }, rows, html);
  html->Element(
      "p", {{"class", "note"}},
      "Progress, slips and collisions are means over complete episodes; time over those that succeeded.");
}

}  // namespace

std::string ReportPage(const Report& report) {
  const auto content = [&](Markup* html) {
    const bool suite = report.runs.size() > 1;
    for (const std::string& remark : report.remarks) html->Element("p", {{"class", "warning"}}, remark);
    for (const std::string& remark : report.viewer_remarks)
      html->Element("p", {{"class", "warning"}, {kUnchecked, ""}}, remark);
    if (suite) SuiteTable(report, html);
    if (suite && report.viewer) WriteViewer(*report.viewer, html, report.opened);
    for (size_t i = 0; i < report.runs.size(); ++i) {
      const ReportRun& run = report.runs[i];
      if (suite) html->Element("h2", {{"id", Id(i)}}, run.run.task_name());
      Subtitle(run, html);
      const RunSection section{run, suite ? Id(i) : "", suite ? "h3" : "h2", suite ? "h4" : "h3", html};
      WriteSummary(section);
      WriteOperators(section);
      WriteFailures(section);
      if (!suite && report.viewer) WriteViewer(*report.viewer, html, report.opened);
      WriteCircumstances(section);
      WriteStages(section);
      WriteDistributions(section);
      WriteEpisodes(section);
      WriteCurves(section);
      WriteMade(section);
    }
  };
  return Page(report.title, report.made_by, report.source, content,
              report.viewer ? &*report.viewer : nullptr);
}

}  // namespace evalbus::report
