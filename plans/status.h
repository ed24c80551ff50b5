// Determines the progress of a plan only from its folder, on any machine that can read the folder.
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
  // is_sequential: true for a plan with `until`, which runs at most `episodes`. has_ended: true if such a
  // plan has stopped.
  bool is_sequential = false, has_ended = false;
  // Number of all episodes, of finished episodes, and of episodes in shards that `evalbus run --part`
  // processes are running. Runs without --part are not counted in `running`.
  int episodes = 0, done = 0, running = 0;
  std::vector<Failed> failed;
  // The active processes, as "HOST-PID  SHARD".
  std::vector<std::string> at_work;
  // Number of finished episodes by policy.
  std::map<std::string, int> by_policy;
  // Episodes per second over the last ten minutes, from the arrival times of shards that are not yet merged;
  // 0 if fewer than two arrived. Text() shows it only while processes are active.
  double rate = 0;
  // Age of the newest result, from the time stamps of files; nullopt if there are no results.
  std::optional<double> newest_s;

  std::string Text() const;
};

PlanStatus StatusOf(const PlanFolder& folder);

}  // namespace evalbus::plans
