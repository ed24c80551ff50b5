// How far a plan is, from its folder alone: on any machine that sees it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

struct PlanStatus {
  struct Failed {
    std::string shard, why;
  };
  // Of all episodes: those that are there, and those of shards that somebody is at work on.
  int episodes = 0, done = 0, running = 0;
  std::vector<Failed> failed;
  // Who is at work, and on what.
  std::vector<std::string> at_work;
  // By policy: episodes that are there.
  std::map<std::string, int> by_policy;
  // Episodes per second of the last ten minutes, by when shards came; 0 where none did.
  double rate = 0;

  std::string Text() const;
};

PlanStatus StatusOf(const PlanFolder& folder);

}  // namespace evalbus::plans
