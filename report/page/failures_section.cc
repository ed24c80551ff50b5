#include <fmt/format.h>

#include <algorithm>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"

namespace evalbus::report {
namespace {

// Number of failures that are shown; the table of episodes lists all failures.
constexpr size_t kShownFailures = 12;

bool IsFailure(const results::RecordedEpisode& episode) {
  return episode.complete && !episode.success && episode.judged();
}

void FailureCard(const RunSection& section, const results::RecordedEpisode& episode) {
  Markup* html = section.html;
  const auto moment = section.run.moments.find(episode.episode);
  const bool has_moment = moment != section.run.moments.end();
  const std::string name = fmt::format("episode {}", episode.episode);
  html->Element("figure", {{"class", "card failure"}}, [&] {
    if (has_moment && !moment->second.image.empty()) {
      html->Empty("img", {{"src", moment->second.image},
                          {"alt", fmt::format("{} at {:.2f} s", name, episode.cause.time_s)},
                          {"width", "480"},
                          {"height", "360"}});
    }
    html->Element("figcaption", {}, [&] {
      html->Element("a",
                    {{"href", has_moment && !moment->second.url.empty() ? moment->second.url
                                                                        : "#" + EpisodeId(section, episode)}},
                    name);
      html->Text(" ");
      html->Element("b", {{"class", "sign bad"}}, "✗ " + end_reason::Text(episode.failure_reason));
      html->Element("div", {}, WhyOf(episode));
      const auto point = section.run.no_returns.find(episode.episode);
      if (point != section.run.no_returns.end())
        html->Element("div", {{"class", "note"}, {kUnchecked, ""}}, results::NoReturnText(point->second));
    });
  });
}

}  // namespace

void WriteFailures(const RunSection& section) {
  const std::vector<results::RecordedEpisode>& episodes = section.run.run.episodes;
  std::vector<const results::RecordedEpisode*> failures;
  for (const results::RecordedEpisode& episode : episodes) {
    if (IsFailure(episode)) failures.push_back(&episode);
  }
  if (failures.empty()) return;
  Markup* html = section.html;
  const size_t shown = std::min(failures.size(), kShownFailures);
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "failed"}},
                  shown < failures.size() ? fmt::format("The first {} of {} failures", shown, failures.size())
                                          : Plural(shown, "failure"));
    html->Element("div", {{"class", "cards failures"}}, [&] {
      for (size_t i = 0; i < shown; ++i) FailureCard(section, *failures[i]);
    });
  });
}

}  // namespace evalbus::report
