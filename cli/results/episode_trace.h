// A recorded episode tick by tick, for figures: every score so far, and what happened when. Computed from the
// log as `evalbus rescore` does.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "viz/report/figures.h"

namespace evalbus::results {

struct EpisodeTrace {
  std::shared_ptr<const model_info_t> model;
  episode_summary_t summary;
  // One for each metric, with a line for each of its parts (arms, distances); what never changes is left out.
  // The figures that explain most come first.
  std::vector<viz::CurveFigure> figures;
  // Stages reached, slips, touches of the scene and of the robot itself, the end; in order of time. A touch
  // that comes back within 0.1 s is the same one.
  std::vector<viz::EpisodeEvent> events;
};

// The last episode of the log. Throws InputError: cannot be read, or holds no episode.
EpisodeTrace TraceEpisode(const std::filesystem::path& log);

}  // namespace evalbus::results
