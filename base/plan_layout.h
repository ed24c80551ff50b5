// Names in the folder of a plan's results (plans/plan_folder.h). Pages also read these files.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

namespace evalbus {

// The resolved plan (PlanJson in plans/plan.h). A folder with this file is a plan's folder.
inline constexpr char kPlanJson[] = "plan.json";
// Contains the run folders of the plan shards until they are merged.
inline constexpr char kPartsFolder[] = "parts";

// Returns the name of a task's run folder in a suite: "lift_pot/position" becomes "lift_pot-position".
inline std::string FolderOfTask(std::string task) {
  std::replace(task.begin(), task.end(), '/', '-');
  return task;
}

// Returns the prefix of the names of a run's shards: "ckpt-1000+lift_pot-position+".
inline std::string ShardPrefix(const std::string& policy, const std::string& task) {
  return policy + "+" + FolderOfTask(task) + "+";
}

// Returns the error for a plan's folder where a run is expected, or where a suite is also accepted. Its
// example is a folder in the plan's folder; without such a folder, it has no example.
std::string PlanNotExpected(const std::filesystem::path& plan, bool accepts_suites);

}  // namespace evalbus
