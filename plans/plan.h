// A plan: the policies to evaluate, the tasks, which episodes are recorded as video, and what is compared.
// Plans are YAML files, described in docs/plans.md.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runner/run_options.h"

namespace evalbus::plans {

struct PlannedPolicy {
  // Name of the policy in the results, and of its folder.
  std::string name;
  // Values for --policy and --contract.
  std::string policy, contract;
  // Values for --latency and --execution; empty: those of Plan::options.
  std::string latency{}, execution{};
};

struct PlannedVideos {
  enum class Which { kNone, kAll, kFailures, kFirst };
  Which which = Which::kNone;
  // Number of episodes of each run to record, for kFirst.
  int first = 0;
  std::vector<std::string> cameras;
};

// Tests the results while the plan runs, and stops a policy early: as soon as its comparison with the
// baseline is decided, or, if `width` is set, as soon as the interval of its success rate on each task is
// that narrow.
struct Until {
  double alpha = 0.05;
  // Maximum number of episodes per task.
  int max_episodes = 0;
  // Whether the comparison uses stages and time to success beside success.
  bool on_progress = false;
  // Width of the 95 % interval, 0 to 1.
  std::optional<double> width = std::nullopt;

  // For example "decided(alpha 0.05, max 200)", "width(0.1, max 2000)".
  std::string Text() const;
};

struct Plan {
  // Defaults to the file's name without its extension.
  std::string name;
  std::vector<PlannedPolicy> policies;
  // Entries TASK/VARIATION, after expansion.
  std::vector<std::string> tasks;
  // Options of every run: episodes, seed, and the entries of "options".
  runner::RunOptions options;
  // Set if "options" contains the value; it then takes precedence over the policy's contract.
  bool rate_is_given = false, timeout_is_given = false;
  PlannedVideos videos;
  // Name of one of the policies; defaults to the first.
  std::string baseline;
  std::optional<Until> until;
  // Number of consecutive episodes of one run that form a shard. Parts of a plan consist of whole shards.
  int shard_episodes = 20;

  int num_runs() const { return static_cast<int>(policies.size() * tasks.size()); }
  // Options for running one policy on all tasks: `options` with the policy and its contract's values. Throws
  // InputError.
  runner::RunOptions OptionsOf(const PlannedPolicy& policy) const;
};

// True if `name` is a plan's file: an existing file that ends in .yaml or .yml and has a top-level key
// `policies`.
bool IsPlanFile(const std::string& name);

// Reads a plan. Throws InputError with file, line and key, also for unknown tasks, policies and contracts.
Plan ReadPlan(const std::filesystem::path& file);

// Returns a plan of these policies on options.tasks, without videos, whose runs have these options. Throws
// InputError.
Plan MakePlan(const std::string& name, const std::vector<std::string>& policies,
              const runner::RunOptions& options, bool rate_is_given);

// Returns the plan with all runs simulated by an engine (runner/engines.h). Throws InputError.
Plan OnEngine(Plan plan, const std::string& engine);

// Converts between a plan and plan.json, its resolved form in a plan's folder. Plans with equal JSON are
// equivalent.
nlohmann::ordered_json PlanJson(const Plan& plan);
Plan PlanOfJson(const nlohmann::json& json, const std::string& file);

// For example "all failures, from overview" or "none".
std::string VideosText(const PlannedVideos& videos);

}  // namespace evalbus::plans
