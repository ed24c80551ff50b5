// Names of tasks whose scenes need assets that are not part of evalbus.
#pragma once

#include <string>
#include <vector>

namespace evalbus {

// Returns the names of assets for which there are tasks. The tasks are in the subfolders of models/tasks with
// these names.
inline const std::vector<std::string>& AssetNames() {
  static const std::vector<std::string> names = {"roboeval"};
  return names;
}

// Returns a task's name without the name of its assets: "lift_pot" for "roboeval_lift_pot". For equal seeds,
// tasks of one family begin their episodes with equal draws.
inline std::string FamilyOf(const std::string& task) {
  for (const std::string& assets : AssetNames()) {
    if (task.starts_with(assets + "_")) return task.substr(assets.size() + 1);
  }
  return task;
}

}  // namespace evalbus
