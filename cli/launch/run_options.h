// What a run is made with, as `evalbus run` takes it.
#pragma once

#include <string>
#include <vector>

#include "sim/sim_component.h"

namespace evalbus::launch {

// The policy that is no process of ours: who says on the bus that it is the policy and ready, takes part.
inline constexpr char kExternalPolicy[] = "lcm";

struct RunOptions {
  // What to run: TASK[/VARIATION], TASK/all, all, RoboEval's names.
  std::vector<std::string> tasks;
  // sim.task is the one of this run.
  sim::SimOptions sim;
  std::string policy = "expert";
  int episodes = 3;
  // Not empty: of these episodes only.
  std::vector<int> only;
  int64_t seed = 0;
  // Empty: runs/TASK-VARIATION-POLICY-DATE-TIME.
  std::string out;
  // Empty: the first that works of multicast on this machine, multicast in a private network namespace, one
  // process.
  std::string url;
  bool in_process = false;
  // Goes on with the run in `out`, if there is one.
  bool resume = false;
  // Episodes (or, of a suite, runs) that are under way at the same time.
  int workers = 1;
  // Not empty, "1/4": this process is that worker of a run.
  std::string share;
  // Cameras whose films are made of each episode.
  std::vector<std::string> video;
};

}  // namespace evalbus::launch
