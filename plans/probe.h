// Estimates the duration and disk usage of a plan from a few sample episodes.
#pragma once

#include <string>

#include "plans/plan.h"

namespace evalbus::plans {

struct Probe {
  // Means over the sampled episodes; the time is wall-clock time on one core of this machine.
  double seconds_per_episode = 0;
  double bytes_per_episode = 0;
  // Files of a run other than its episodes, mainly the models.
  double bytes_per_run = 0;
  int episodes = 0;
  // One-line reason why some samples failed; empty if all succeeded.
  std::string problem;
};

// Runs the first episode of at most `most` runs of the plan in a temporary folder. The runs are spread evenly
// over policies and tasks. Prints a line with their number and the addresses of the policies' servers to
// stderr.
Probe ProbePlan(const Plan& plan, int most);

}  // namespace evalbus::plans
