// Converts a recorded episode to curves of all metrics over its ticks, and to a list of events.
#pragma once

#include <vector>

#include "report/page/figures.h"
#include "viz/viewer/episode_track.h"

namespace evalbus::report {

struct EpisodeTrace {
  // One figure for each metric, with a line for each of its parts (arms, distances). Constant metrics are
  // omitted. The most informative figures come first.
  std::vector<CurveFigure> figures;
  // Stages reached, slips, collisions with the scene, self-collisions, force limits exceeded, and the end, in
  // order of time.
  std::vector<EpisodeEvent> events;
};

EpisodeTrace Trace(const viz::EpisodeTrack& track);

}  // namespace evalbus::report
