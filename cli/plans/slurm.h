// A plan as jobs of a Slurm cluster: one job array, whose tasks are parts of the plan, and a job that merges.
// Requeueing, limits and accounting are Slurm's.
#pragma once

#include <string>
#include <vector>

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

struct SlurmOptions {
  bool submit = false, dry_run = false;
  // As sbatch takes them; empty: the cluster's own.
  std::string partition, time;
  // So many tasks, with so many processors each; 0: such that each takes about ten minutes.
  int array_size = 0;
  int cpus = 1;
};

struct SlurmScripts {
  // Parts of the plan that have something left to do, of `parts`.
  std::vector<int> todo;
  int parts = 0;
  std::string array, merge;
};

// `parts`: of the plan in all; a plan's folder keeps the number that it was submitted with.
SlurmScripts WriteSlurmScripts(const PlanFolder& folder, const SlurmOptions& options, int parts);

// Writes the scripts into the plan's folder and submits them, or says them (dry_run). Throws InputError where
// nothing is left to do, EnvironmentError with sbatch's words.
void RunOnSlurm(const PlanFolder& folder, const SlurmOptions& options);

}  // namespace evalbus::plans
