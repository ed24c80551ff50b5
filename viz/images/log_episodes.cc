#include "viz/images/log_episodes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <set>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "models/physics_model.h"

namespace evalbus::viz {

std::vector<int> EpisodesOf(const std::filesystem::path& log) {
  EpisodeReader reader(log, {channels::kState});
  std::vector<int> numbers;
  for (EpisodeMessages episode; reader.Next(&episode);) {
    if (!episode.states.empty()) numbers.push_back(episode.number());
  }
  if (reader.log().damaged_places() > 0) {
    std::cerr << "warning: " << log.string() << ": " << Plural(reader.log().damaged_bytes(), "damaged byte")
              << " skipped; the video holds the image where ticks are missing" << std::endl;
  }
  if (!reader.has_model()) throw InputError(log.string() + ": no complete MODEL message in this log");
  if (numbers.empty()) throw InputError(log.string() + ": no complete STATE message in this log");
  return numbers;
}

void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted) {
  for (const int number : wanted) {
    if (std::ranges::find(numbers, number) != numbers.end()) continue;
    throw InputError(fmt::format("{} has no episode {}; it has {}", log.string(), number,
                                 fmt::join(std::set(numbers.begin(), numbers.end()), ", ")));
  }
}

double DecisiveMoment(const EpisodeMessages& episode) {
  if (episode.summary && !episode.summary->cause.kind.empty()) return episode.summary->cause.time_s;
  throw InputError(
      fmt::format("--highlight: the log has no decisive moment of episode {}; 'evalbus rescore' finds it",
                  episode.number()));
}

std::vector<FrameTime> TimesOf(const EpisodeMessages& episode, VideoTiming timing) {
  if (timing.highlight_s > 0 && timing.moments_s.empty()) timing.moments_s = {DecisiveMoment(episode)};
  return FrameTimes(timing, episode.states.back().header.sim_time_us);
}

bool ShowsEnd(const EpisodeMessages& episode, const VideoTiming& timing) {
  return episode.end && (!timing.to_s || *timing.to_s >= Seconds(episode.states.back().header.sim_time_us));
}

ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log) {
  UseModelsIn(RunFolderOf(log), &info);
  return LoadVisualModel(info);
}

}  // namespace evalbus::viz
