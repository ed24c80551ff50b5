// Runs a plan on a Slurm cluster, with a job array, whose tasks are parts of the plan, and a job that merges
// the results. Slurm handles requeueing, limits and accounting.
#pragma once

#include <string>
#include <vector>

#include "plans/plan_folder.h"

namespace evalbus::plans {

struct SlurmOptions {
  bool submit = false, dry_run = false;
  // Values of sbatch's options --partition and --time; empty: the cluster's defaults.
  std::string partition, time;
  // Number of tasks in the array, each with `cpus` processors. 0: chosen so that each task takes about ten
  // minutes.
  int array_size = 0;
  int cpus = 1;

  bool operator==(const SlurmOptions&) const = default;
};

struct SlurmScripts {
  // Numbers of the parts that have unfinished shards; `parts` is the number of all parts.
  std::vector<int> todo;
  int parts = 0;
  std::string array, merge;
};

// Returns the scripts of the job array and of the merge job. `parts`: total number of parts of the plan.
SlurmScripts WriteSlurmScripts(const PlanFolder& folder, const SlurmOptions& options, int parts);

// Writes the scripts into the plan's folder and submits them; with dry_run, prints them instead. Throws
// InputError if all shards are finished, EnvironmentError with sbatch's output if sbatch fails.
void RunOnSlurm(const PlanFolder& folder, const SlurmOptions& options);

}  // namespace evalbus::plans
