// A plan lists the policies to evaluate, the tasks, the episodes to record as video, and the baseline. Plans
// are YAML files, which docs/plans.md describes.
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
  // Values for --latency and --execution; empty: the values in Plan::options.
  std::string latency{}, execution{};
  // Location in the plan's file, as a prefix of messages: "plan.yaml:2: key 'policies[0]': ".
  std::string where{};
};

struct PlannedVideos {
  enum class Which { kNone, kAll, kFailures, kFirst };
  Which which = Which::kNone;
  // Number of episodes of each run to record if `which` is kFirst.
  int first = 0;
  std::vector<std::string> cameras;
  // Location of the cameras in the plan's file, as a prefix of messages.
  std::string where{};
};

// Rule that tests the results while the plan runs, and stops a policy early. A policy stops when its
// comparison with the baseline is decided or has become hopeless (Stop::is_hopeless) or, if `width` is set,
// when the interval of its success rate on each task is at most this wide. It always stops after
// max_episodes.
struct Until {
  double alpha = 0.05;
  // Maximum number of episodes per task.
  int max_episodes = 0;
  // True if the comparison uses stages and time to success in addition to success.
  bool on_progress = false;
  // Largest accepted width of the 95 % interval, from 0 to 1.
  std::optional<double> width = std::nullopt;

  // Returns the rule as in a plan's file, for example "decided(alpha 0.05, max 200)" or "width(0.1, max
  // 2000)".
  std::string Text() const;
};

struct Plan {
  // Name of the plan; the default is the file's name without its extension.
  std::string name;
  std::vector<PlannedPolicy> policies;
  // Tasks after expansion: TASK/VARIATION, or the paths of task files.
  std::vector<std::string> tasks;
  // Location of the tasks in the plan's file, as a prefix of messages.
  std::string tasks_where;
  // Options of every run: episodes, seed, and the entries of "options".
  runner::RunOptions options;
  // True if "options" contains the control rate or the timeout, which then takes precedence over the policy's
  // contract.
  bool rate_is_given = false, timeout_is_given = false;
  PlannedVideos videos;
  // Name of one of the policies; the default is the first policy.
  std::string baseline;
  std::optional<Until> until;
  // Number of consecutive episodes of one run that form a shard. Parts of a plan consist of whole shards.
  int shard_episodes = 20;

  int num_runs() const { return static_cast<int>(policies.size() * tasks.size()); }
  // Returns the options for running one policy on all tasks: `options`, the policy, and values of its
  // contract. Throws InputError.
  runner::RunOptions OptionsOf(const PlannedPolicy& policy) const;
  // Returns the addresses of the policies' servers, each once, in the order of the policies.
  std::vector<std::string> Servers() const;
};

// Returns whether `name` is an existing file whose name ends in .yaml or .yml and which has a top-level key
// `policies`.
bool IsPlanFile(const std::string& name);

// Reads a plan. Throws InputError with file, line and key. Unknown tasks, policies and contracts are also
// errors.
Plan ReadPlan(const std::filesystem::path& file);

// Returns a plan that evaluates these policies on options.tasks with these options, without videos. Throws
// InputError.
Plan MakePlan(const std::string& name, const std::vector<std::string>& policies,
              const runner::RunOptions& options, bool rate_is_given);

// Returns the plan with the engine of all runs set to `engine` (runner/engines.h), and with in_process set if
// the engine permits it. Checks the options of all policies. Throws InputError.
Plan OnEngine(Plan plan, const std::string& engine);

// Converts between a plan and plan.json, its resolved form in a plan's folder. Plans with equal JSON are
// equivalent.
nlohmann::ordered_json PlanJson(const Plan& plan);
Plan PlanOfJson(const nlohmann::json& json, const std::string& file);

// Returns a description of the videos, for example "failures, from overview" or "none".
std::string VideosText(const PlannedVideos& videos);

}  // namespace evalbus::plans
