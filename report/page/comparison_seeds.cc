#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "report/page/comparison_page.h"
#include "report/page/page.h"

namespace evalbus::report {
namespace {

StripCell CellOf(const results::PairedEpisode& episode, const std::string& run, int64_t seed,
                 const std::string& url) {
  return {.css_class = episode.success ? "good" : "bad",
          .text = std::to_string(episode.episode),
          .title = fmt::format("{}, episode {}, seed {}: {}", run, episode.episode, seed,
                               end_reason::Outcome(episode.failure_reason)),
          .url = url};
}

void SeedsStrip(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, Markup* html) {
  std::vector<std::vector<StripCell>> columns;
  for (const results::ComparedPair& pair : task.pairs) {
    const std::string url = parts.player_url(task, pair);
    columns.push_back({CellOf(pair.baseline, comparison.baseline.name, pair.seed, url),
                       CellOf(pair.run, comparison.run.name, pair.seed, url)});
  }
  WriteStrip(columns, html);
  const size_t size = ColumnsPerSquare(columns.size());
  html->Element("p", {{"class", "legend"}}, [&] {
    LegendKey("good", "success", html);
    LegendKey("bad", "no success", html);
    html->Text(fmt::format("{}: {} above, {} below",
                           size == 1 ? "one column per seed" : fmt::format("{} seeds per column", size),
                           comparison.baseline.name, comparison.run.name));
  });
}

// Summarizes seeds where only one side succeeds, for example "9 seeds where only expert succeeds: 6 slipped
// from the gripper, 3 dropped".
std::string OneSided(const std::vector<results::ComparedPair>& flipped, bool of_run,
                     const std::string& name) {
  std::map<std::string, int> counts;
  int count = 0;
  for (const results::ComparedPair& pair : flipped) {
    if (pair.run.success != of_run) continue;
    ++count;
    ++counts[pair.failed().failure_reason];
  }
  if (count == 0) return "";
  // The most frequent reasons come first, as in a run's results.
  std::vector<std::pair<std::string, int>> reasons(counts.begin(), counts.end());
  std::ranges::stable_sort(reasons, std::greater(), &std::pair<std::string, int>::second);
  std::string text = fmt::format("{} where only {} succeeds: ", Plural(count, "seed"), name);
  for (const auto& [reason, number] : reasons)
    text += fmt::format("{} {}, ", number, end_reason::Text(reason));
  return text.substr(0, text.size() - 2);
}

// Writes the images of the pairs that have them. `evalbus verify` does not render images, so it ignores them.
// Returns the number of these pairs.
size_t StillCards(const ComparisonPageParts& parts, const results::Comparison& comparison,
                  const results::TaskComparison& task, const std::vector<results::ComparedPair>& flipped,
                  Markup* html) {
  const auto has_stills = [&](const auto& pair) { return parts.stills(task, pair) != nullptr; };
  const auto count = static_cast<size_t>(std::ranges::count_if(flipped, has_stills));
  if (count == 0) return 0;
  html->Element("p", {{"class", "note"}, {kUnchecked, ""}},
                fmt::format("At the decisive moment: {} on the left, {} on the right.",
                            comparison.baseline.name, comparison.run.name));
  html->Element("div", {{"class", "cards pairs"}, {kUnchecked, ""}}, [&] {
    for (const results::ComparedPair& pair : flipped) {
      const PairStills* const stills = parts.stills(task, pair);
      if (!stills) continue;
      const results::PairedEpisode& failed = pair.failed();
      const std::string url = parts.player_url(task, pair);
      const std::string name = fmt::format("episode {}", pair.run.episode);
      html->Element("figure", {{"class", "card failure"}}, [&] {
        html->Element("div", {{"class", "pair"}}, [&] {
          for (const auto& [image, run] : {std::pair(&stills->baseline, &comparison.baseline.name),
                                           {&stills->run, &comparison.run.name}}) {
            html->Empty("img", {{"src", *image},
                                {"alt", fmt::format("{}, {} at {:.2f} s", *run, name, failed.cause.time_s)},
                                {"width", "480"},
                                {"height", "360"}});
          }
        });
        html->Element("figcaption", {}, [&] {
          if (url.empty()) {
            html->Text(name);
          } else {
            html->Element("a", {{"href", url}}, name);
          }
          html->Text(" ");
          html->Element(
              "b", {{"class", "sign bad"}},
              fmt::format("✗ {}: {}", pair.run.success ? comparison.baseline.name : comparison.run.name,
                          end_reason::Text(failed.failure_reason)));
          html->Element("div", {}, failed.cause.text);
        });
      });
    }
  });
  return count;
}

void FlippedRow(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, const results::ComparedPair& pair, Markup* html) {
  const std::string url = parts.player_url(task, pair);
  const std::string seed = std::to_string(pair.seed);
  const results::PairedEpisode& failed = pair.failed();
  const bool run_failed = !pair.run.success;
  html->Element("tr", {}, [&] {
    html->Element("td", {{"class", "number"}}, [&] {
      const std::string text = fmt::format("episode {}", pair.run.episode);
      if (url.empty()) return html->Text(text);
      const char* const at = failed.cause.text.empty() ? "" : ", one second before the decisive moment";
      html->Element("a", {{"href", url}, {"title", std::string("both in 3D") + at}}, text);
    });
    html->Element("td", {}, [&] {
      html->Element("span", {{"class", "sign bad"}}, "✗");
      html->Text(" " + (run_failed ? comparison.run.name : comparison.baseline.name));
    });
    html->Element("td", {{"class", "why"}}, [&] {
      html->Element("b", {}, end_reason::Text(failed.failure_reason));
      if (!failed.cause.text.empty()) html->Text(": " + failed.cause.text);
    });
    html->Element("td", {{"class", "files"}, {kUnchecked, ""}}, [&] {
      Links(parts.videos(task.baseline_folder, pair.baseline.episode), html);
      Links(parts.videos(task.folder, pair.run.episode), html);
    });
    html->Element("td", {{"class", "number seed"}}, seed);
  });
}

void FlippedTable(const ComparisonPageParts& parts, const results::Comparison& comparison,
                  const results::TaskComparison& task, const std::vector<results::ComparedPair>& flipped,
                  Markup* html) {
  const auto titles = [&] {
    html->Element("th", {{"class", "number"}}, "episode");
    html->Element("th", {}, "failed");
    html->Element("th", {}, "why");
    html->Element("th", {{"class", "unsorted files"}}, "videos");
    html->Element("th", {{"class", "number"}}, "seed");
  };
  const auto rows = [&] {
    for (const results::ComparedPair& pair : flipped) FlippedRow(parts, comparison, task, pair, html);
  };
  ScrollingTable({{"class", "sortable"}}, titles, rows, html);
}

}  // namespace

void WriteSeeds(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, const char* heading, Markup* html) {
  if (task.pairs.empty()) return;
  html->Element(heading, {}, "Seeds");
  SeedsStrip(parts, comparison, task, html);
  const std::vector<results::ComparedPair> flipped = task.flipped();
  for (const bool of_run : {false, true}) {
    const std::string text =
        OneSided(flipped, of_run, of_run ? comparison.run.name : comparison.baseline.name);
    if (!text.empty()) html->Element("p", {}, text + ".");
  }
  if (flipped.empty()) return;
  const size_t shown = StillCards(parts, comparison, task, flipped, html);
  // A table of at most kFew rows is open by default, unless the images already show all of them.
  constexpr size_t kFew = 4;
  html->Open("details", {});
  if (flipped.size() <= kFew && shown < flipped.size()) html->Attribute("open", "");
  html->Element("summary", {}, "Why: " + Plural(flipped.size(), "seed") + " where only one policy succeeds");
  FlippedTable(parts, comparison, task, flipped, html);
  const bool any_video = std::ranges::any_of(flipped, [&](const results::ComparedPair& pair) {
    return !parts.videos(task.folder, pair.run.episode).empty() ||
           !parts.videos(task.baseline_folder, pair.baseline.episode).empty();
  });
  if (!any_video) {
    html->Element("p", {{"class", "note"}, {kUnchecked, ""}},
                  "There are no videos of these episodes: evalbus render RUN --episode N makes them; run "
                  "evalbus compare --report again to link them here.");
  }
  html->Close();
}

}  // namespace evalbus::report
