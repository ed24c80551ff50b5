// A plan: which policies are evaluated on which tasks, what is recorded as video, and what is compared. A
// YAML file; docs/plans.md describes it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/launch/run_options.h"

namespace evalbus::plans {

struct PlannedPolicy {
  // What results call it, and its folder.
  std::string name;
  // As --policy and --contract take them.
  std::string policy, contract;
};

struct PlannedVideos {
  enum class Which { kNone, kAll, kFailures, kFirst };
  Which which = Which::kNone;
  // Of kFirst.
  int first = 0;
  std::vector<std::string> cameras;
};

// Compares each policy with the baseline while they run, and stops when it is clear.
struct Until {
  double alpha = 0.05;
  // Episodes of each task after which it ends in any case.
  int max_episodes = 0;

  // "decided(alpha 0.05, max 200)"
  std::string Text() const;
};

struct Plan {
  // The file's name without its ending, where it says none.
  std::string name;
  std::vector<PlannedPolicy> policies;
  // TASK/VARIATION, expanded.
  std::vector<std::string> tasks;
  // Of every run: episodes, seed, and what "options" says.
  launch::RunOptions options;
  // "options" names it: no contract's goes before it.
  bool rate_is_given = false, timeout_is_given = false;
  PlannedVideos videos;
  // One of the policies' names; the first where the file names none.
  std::string baseline;
  std::optional<Until> until;
  // A part of the plan is whole shards: so many episodes of one run.
  int shard_episodes = 20;

  int num_runs() const { return static_cast<int>(policies.size() * tasks.size()); }
  // Of one policy on all tasks: `options` with the policy, and what its contract says. Throws InputError.
  launch::RunOptions OptionsOf(const PlannedPolicy& policy) const;
};

// True for the name of a plan's file: ends in .yaml or .yml, and has a key `policies` at its top.
bool IsPlanFile(const std::string& name);

// Throws InputError with file, line and key, also for unknown tasks, policies and contracts.
Plan ReadPlan(const std::filesystem::path& file);

// The plan resolved, as a plan's folder keeps it, and back. Two plans with the same JSON mean the same.
nlohmann::ordered_json PlanJson(const Plan& plan);
Plan PlanOfJson(const nlohmann::json& json, const std::string& file);

// "all failures, from overview"; "none".
std::string VideosText(const PlannedVideos& videos);

}  // namespace evalbus::plans
