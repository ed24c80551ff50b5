#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"
#include "report/page/scale.h"
#include "results/summary_table.h"

namespace evalbus::report {
namespace {

const char* OutcomeSign(const results::RecordedEpisode& episode) {
  return !episode.complete || !episode.judged() ? "–" : episode.success ? "✓" : "✗";
}

bool HasReason(const results::RecordedEpisode& episode) {
  if (episode.success && episode.complete) return !results::SuccessText(episode.cause.text).empty();
  return !episode.failure_reason.empty() || !WhyOf(episode).empty();
}

void Titles(bool explained, bool noted, Markup* html) {
  html->Element("th", {{"class", "number"}}, "episode");
  html->Element("th", {}, "end");
  if (explained) html->Element("th", {}, "why");
  if (noted) html->Element("th", {{kUnchecked, ""}}, "note");
  for (const char* title : {"ended at, s", "stages", "slips", "collisions", "clearance, mm", "path, m"}) {
    html->Element("th", {{"class", "number"}}, title);
  }
  html->Element("th", {{"class", "unsorted files"}}, "files");
  html->Element("th", {{"class", "number"}}, "seed");
}

// Writes the reason, which is a link if the page can play the episode.
void ReasonCell(const RunSection& section, const results::RecordedEpisode& episode) {
  Markup* html = section.html;
  const auto moment = section.run.moments.find(episode.episode);
  const std::string url = moment == section.run.moments.end() ? "" : moment->second.url;
  html->Element("td", {{"class", "why"}}, [&] {
    if (!HasReason(episode)) return;
    if (episode.success && episode.complete) return html->Text(results::SuccessText(episode.cause.text));
    // If the sentence starts with the reason, the reason is not repeated.
    const std::string reason = end_reason::Text(episode.failure_reason);
    const std::string& why = WhyOf(episode);
    const bool begins = why.starts_with(reason);
    if (!reason.empty()) {
      html->Element("b", {}, [&] {
        if (url.empty()) return html->Text(reason);
        html->Element("a", {{"href", url}, {"title", "in 3D"}}, reason);
      });
    }
    if (why.empty()) return;
    html->Text(begins ? why.substr(reason.size()) : ": " + why);
  });
}

void StageCell(const results::RecordedEpisode& episode, Markup* html) {
  int stages = 0, reached = 0;
  for (const auto& [index, is_reached] : episode.stages) {
    ++stages;
    reached += is_reached;
  }
  NumberCell(stages > 0 ? reached : std::numeric_limits<double>::quiet_NaN(),
             fmt::format("{}/{}", reached, stages), html);
}

void NumberCells(const results::RecordedEpisode& episode, Markup* html) {
  const double time = ValueOf(episode, "completion_time");
  NumberCell(time, fmt::format("{:.2f}", time), html);
  StageCell(episode, html);
  NumberCell(ValueOf(episode, "slip_count"), html);
  const double scene = ValueOf(episode, "env_collision_count");
  const double self = ValueOf(episode, "self_collision_count");
  NumberCell(scene + self, fmt::format("{} + {}", Number(scene), Number(self)), html);
  const double clearance = ValueOf(episode, "extended.min_clearance_m");
  NumberCell(clearance, Fixed(clearance * 1e3, 0), html);
  const double path = FirstOf(episode, {"total_cartesian_path_length", "cartesian_path_length"});
  NumberCell(path, fmt::format("{:.2f}", path), html);
}

void FilesCell(const EpisodeFiles& files, Markup* html) {
  html->Element("td", {{"class", "files"}, {kUnchecked, ""}}, [&] {
    Links(files.videos, html);
    Links(files.logs, html);
  });
}

void EpisodeRow(const RunSection& section, size_t index, bool explained, bool noted, bool drawn) {
  const results::RecordedEpisode& episode = section.run.run.episodes[index];
  Markup* html = section.html;
  const std::string number = std::to_string(episode.episode);
  html->Element("tr", {{"id", EpisodeId(section, episode)}, {"class", Outcome(episode)}}, [&] {
    html->Element("th", {{"class", "number"}, {"scope", "row"}}, [&] {
      if (!drawn) return html->Text(number);
      html->Element("a", {{"href", "#" + section.id + "curves-" + number}, {"title", "its curves"}}, number);
    });
    html->Element("td", {{"class", "end"}}, [&] {
      html->Element("span", {{"class", std::string("sign ") + Outcome(episode)}}, OutcomeSign(episode));
      html->Text(" " + end_reason::Text(episode.end_reason) + (episode.complete ? "" : ", not complete"));
    });
    if (explained) ReasonCell(section, episode);
    if (noted) html->Element("td", {{"class", "why"}, {kUnchecked, ""}}, episode.note);
    NumberCells(episode, html);
    FilesCell(section.run.files[index], html);
    html->Element("td", {{"class", "number seed"}}, std::to_string(episode.seed));
  });
}

// Writes a checkbox that hides successful episodes by means of report.css. The checkbox is omitted if there
// are only failures or only successes.
void OnlyFailures(const RunSection& section) {
  const std::vector<results::RecordedEpisode>& episodes = section.run.run.episodes;
  const auto failures =
      std::ranges::count_if(episodes, [](const auto& e) { return !(e.success && e.complete); });
  if (failures == 0 || failures == std::ssize(episodes)) return;
  const std::string id = section.id + "only-failures";
  section.html->Empty("input", {{"type", "checkbox"}, {"class", "only-failures"}, {"id", id}});
  section.html->Element("label", {{"for", id}}, fmt::format("only the {} without success", failures));
}

}  // namespace

void WriteEpisodes(const RunSection& section) {
  const ReportRun& run = section.run;
  Markup* html = section.html;
  std::set<int> drawn;
  for (const ReportCurves& curves : run.curves) drawn.insert(curves.episode);
  const bool explained = std::ranges::any_of(run.run.episodes, HasReason);
  const bool noted =
      std::ranges::any_of(run.run.episodes, [](const auto& episode) { return !episode.note.empty(); });
  const auto rows = [&] {
    for (size_t i = 0; i < run.run.episodes.size(); ++i)
      EpisodeRow(section, i, explained, noted, drawn.contains(run.run.episodes[i].episode));
  };
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "episodes"}}, "Episodes");
    OnlyFailures(section);
    ScrollingTable(
        {{"class", "sortable episodes"}, {"id", section.id + "episode-table"}},
        [&] { Titles(explained, noted, html); }, rows, html);
    html->Element(
        "p", {{"class", "note"}},
        "Collisions are contacts with the scene + contacts of the robot with itself; contacts with the "
        "objects of the task are not counted.");
    if (std::ranges::all_of(run.files, [](const auto& files) { return files.videos.empty(); })) {
      html->Element("p", {{"class", "note"}, {kUnchecked, ""}},
                    "There are no videos of this run: evalbus render " + run.run.name +
                        " renders them; running evalbus report again then links them here.");
    }
  });
}

}  // namespace evalbus::report
