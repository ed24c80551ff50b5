// Names of the scene parts whose poses a source cannot provide.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/task_description.h"

namespace evalbus {

// Returns the names of the parts that are free or placed by a variation, but not among the model's objects. A
// source publishes poses of objects only.
inline std::vector<std::string> UnlocatedParts(const TaskDescription& task, const model_info_t& model) {
  std::vector<std::string> names;
  for (const ScenePart& part : task.parts) {
    const bool is_object = std::ranges::find(model.object_name, part.name) != model.object_name.end();
    if (!is_object && (part.free || part.placed)) names.push_back(part.name);
  }
  return names;
}

}  // namespace evalbus
