#include "report/page/comparison_page.h"

#include <fmt/format.h>

#include "results/comparison_text.h"
#include "results/conclusion.h"

namespace evalbus::report {
namespace {

void Write(const ComparisonPageParts& parts, const results::Comparison& comparison, Markup* html) {
  // Sections are below the page's heading. If there are several comparisons, each has a heading; if there are
  // several tasks, each has a heading. Each of these levels moves the sections one level down.
  constexpr const char* kHeadings[] = {"h2", "h3", "h4"};
  size_t level = parts.comparisons.size() > 1 ? 1 : 0;
  html->Element("p", {{"class", "verdict"}}, WithMinus(results::Evidence(comparison)));
  WriteSuccess(comparison, html);
  const bool has_tasks = comparison.tasks.size() > 1;
  const char* const of_task = kHeadings[level];
  if (has_tasks) ++level;
  for (const results::TaskComparison& task : comparison.tasks) {
    if (has_tasks) html->Element(of_task, {}, task.name());
    WriteSeeds(parts, comparison, task, kHeadings[level], html);
    WriteMetrics(comparison, task, kHeadings[level], html);
  }
  const auto note = [&](const std::string& text) { html->Element("p", {{"class", "note"}}, text); };
  for (const std::string& remark : comparison.remarks) note(WithMinus(remark));
  note(fmt::format("Test of success: {}. Adjusted p: adjusted for the number of tests in the table. {}",
                   results::TestName(comparison.success.test), results::kIntervalsAreSingle));
}

// Returns the URL of the first flipped pair that the page contains.
std::string OpenedPair(const ComparisonPageParts& parts) {
  for (const results::Comparison& comparison : parts.comparisons) {
    for (const results::TaskComparison& task : comparison.tasks) {
      for (const results::ComparedPair& pair : task.flipped()) {
        if (const std::string url = parts.player_url(task, pair); !url.empty()) return url;
      }
    }
  }
  return "";
}

}  // namespace

std::string ComparisonPage(const ComparisonPageParts& parts) {
  const bool is_one = parts.comparisons.size() == 1;
  const auto content = [&](Markup* html) {
    for (const results::Comparison& comparison : parts.comparisons) {
      const std::string who =
          results::NameAndPolicy(comparison.run) + " against " + results::NameAndPolicy(comparison.baseline);
      const std::string where = comparison.tasks.size() == 1
                                    ? ", " + comparison.tasks[0].name()
                                    : fmt::format(", {} tasks", comparison.tasks.size());
      if (!is_one) html->Element("h2", {}, WithMinus(results::Headline(comparison)));
      html->Element("p", {{"class", "subtitle"}}, who + where);
      Write(parts, comparison, html);
    }
    if (parts.viewer) WriteViewer(*parts.viewer, html, OpenedPair(parts));
    for (const std::string& note : parts.viewer_notes)
      html->Element("p", {{"class", "note"}, {kUnchecked, ""}}, note);
  };
  return Page(WithMinus(results::Headline(parts.comparisons)), parts.made_by, parts.source, content,
              parts.viewer ? &*parts.viewer : nullptr);
}

}  // namespace evalbus::report
