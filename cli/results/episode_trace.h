// A recorded episode tick by tick, as figures: every score so far, and what happened when.
#pragma once

#include <vector>

#include "viz/report/figures.h"
#include "viz/viewer/episode_track.h"

namespace evalbus::results {

struct EpisodeTrace {
  // One for each metric, with a line for each of its parts (arms, distances); what never changes is left out.
  // The figures that explain most come first.
  std::vector<viz::CurveFigure> figures;
  // Stages reached, slips, touches of the scene and of the robot itself, the end; in order of time.
  std::vector<viz::EpisodeEvent> events;
};

EpisodeTrace Trace(const viz::EpisodeTrack& track);

}  // namespace evalbus::results
