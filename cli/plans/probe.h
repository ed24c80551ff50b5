// How long a plan will take and how much room, from an episode here and there.
#pragma once

#include <cstdint>
#include <string>

#include "cli/plans/plan.h"

namespace evalbus::plans {

struct Probe {
  // Mean of the episodes tried; wall-clock time on one core of this machine.
  double seconds_per_episode = 0;
  double bytes_per_episode = 0;
  int episodes = 0;
  // Why some could not be tried, one line; empty where all could.
  std::string problem;
};

// Runs the first episode of at most `most` runs of the plan, spread over policies and tasks, in a folder that
// is gone afterwards.
Probe ProbePlan(const Plan& plan, int most);

}  // namespace evalbus::plans
