// Progress of a plan, read from its folder alone, on any machine that can read the folder.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "plans/plan_folder.h"

namespace evalbus::plans {

struct PlanStatus {
  struct Failed {
    std::string shard, why;
  };
  // True for a plan with `until`, which runs at most `episodes`; has_ended: it has stopped.
  bool is_sequential = false, has_ended = false;
  // Counts of episodes: all, finished, and in shards that are being run by machines with `run --part`.
  // Without parts, runs do not announce themselves.
  int episodes = 0, done = 0, running = 0;
  std::vector<Failed> failed;
  // Entries "HOST-PID  SHARD" of the active processes.
  std::vector<std::string> at_work;
  // Number of finished episodes by policy.
  std::map<std::string, int> by_policy;
  // Episodes per second over the last ten minutes, from the arrival times of shards; 0 if none arrived.
  double rate = 0;
  // Age of the newest result, from the time stamps of files.
  std::optional<double> newest_s;

  std::string Text() const;
};

PlanStatus StatusOf(const PlanFolder& folder);

}  // namespace evalbus::plans
