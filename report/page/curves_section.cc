#include <fmt/format.h>

#include <algorithm>

#include "lcmtypes/end_reason.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"

namespace evalbus::report {
namespace {

// Number of figures that are initially visible; the other figures can be expanded.
constexpr size_t kCurvesShown = 6;

void Event(const EpisodeEvent& event, bool video, Markup* html) {
  DrawEventMark(event.kind, html);
  const std::string time = fmt::format("{:.2f} s", event.time);
  if (video) {
    html->Element(
        "button",
        {{"type", "button"}, {"data-seek", fmt::format("{}", event.time)}, {"title", "show in the video"}},
        time);
  } else {
    html->Element("span", {{"class", "time"}}, time);
  }
  html->Text(" " + event.text);
}

void Events(const std::vector<EpisodeEvent>& events, bool video, Markup* html) {
  // Without 3D, the list has no buttons, and the keyboard can scroll it only if it has the focus.
  html->Element("ol", {{"class", "events"}, {"tabindex", "0"}}, [&] {
    for (const EpisodeEvent& event : events) html->Element("li", {}, [&] { Event(event, video, html); });
  });
}

void LineKey(const std::string& name, size_t index, Markup* html) {
  html->Element("span", {{"class", "key"}}, [&] {
    html->Element("svg", {{"class", "swatch"}, {"viewBox", "0 0 18 8"}, {"aria-hidden", "true"}}, [&] {
      html->Empty("path", {{"class", "line " + LineColor(name, index)}, {"d", "M0 4H18"}});
    });
    html->Text(name);
  });
}

void CurveCard(const CurveFigure& figure, Markup* html) {
  html->Element("figure", {{"class", "card"}}, [&] {
    html->Element("figcaption", {}, [&] {
      html->Text(figure.name);
      if (!figure.unit.empty()) html->Element("span", {{"class", "unit"}}, ", " + figure.unit);
      if (figure.lines.size() == 1 && figure.lines[0].name.empty()) return;
      html->Element("span", {{"class", "lines"}}, [&] {
        for (size_t k = 0; k < figure.lines.size(); ++k) LineKey(figure.lines[k].name, k, html);
      });
    });
    DrawCurves(figure, html);
  });
}

void EpisodeCurves(const RunSection& section, const ReportCurves& curves,
                   const results::RecordedEpisode& episode, const std::vector<ReportLink>& videos) {
  Markup* html = section.html;
  html->Element(section.subheading, {},
                fmt::format("Episode {}: {}{}", curves.episode,
                            end_reason::Text(episode.failure_reason.empty() ? episode.end_reason
                                                                            : episode.failure_reason),
                            curves.why.empty() ? "" : " (" + curves.why + ")"));
  if (!WhyOf(episode).empty()) html->Element("p", {}, WhyOf(episode));
  const bool video = !videos.empty();
  html->Element("div", {{"class", video ? "beside" : ""}}, [&] {
    if (video) {
      html->Element("video", {{"controls", ""}, {"preload", "metadata"}, {"src", videos[0].url}}, "");
    }
    Events(curves.events, video, html);
  });
  std::vector<std::function<void()>> figures;
  for (const CurveFigure& figure : curves.figures) figures.push_back([&] { CurveCard(figure, html); });
  Folded(figures, kCurvesShown, "more curves", "curves", html);
}

}  // namespace

void WriteCurves(const RunSection& section) {
  const ReportRun& run = section.run;
  if (run.curves.empty()) return;
  Markup* html = section.html;
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "curves"}}, "Episodes over time");
    html->Element("p", {{"class", "note"}},
                  "Scores up to each tick, computed from the logs. Constant values are not shown.");
    for (const ReportCurves& curves : run.curves) {
      const auto& episodes = run.run.episodes;
      const auto episode = std::ranges::find(episodes, curves.episode, &results::RecordedEpisode::episode);
      if (episode == episodes.end()) continue;
      const EpisodeFiles& files = run.files[static_cast<size_t>(episode - episodes.begin())];
      html->Element("article", {{"id", fmt::format("{}curves-{}", section.id, curves.episode)}},
                    [&] { EpisodeCurves(section, curves, *episode, files.videos); });
    }
  });
}

}  // namespace evalbus::report
