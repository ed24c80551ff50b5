// The scripted experts; each is implemented in a separate file.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

struct HandledObject {
  // Name of an object of the task. The object's file has the sites left_handle (on +y) and right_handle (on
  // -y), each in the middle of a bar along the object's x axis.
  std::string name;
  // Position that both arms reach best. An object is dragged toward it, by the first of the fractions `drags`
  // of the distance that makes a lift possible.
  Eigen::Vector2d sweet_spot;  // m
  std::vector<double> drags;
  // If the object's origin is farther to the left (+y) than this (m), the object is dragged before it is
  // lifted.
  double max_y;
};

// Each of these functions throws InputError if the model lacks an object that the expert handles, or has too
// few arms.
using MakeTaskExpert = std::unique_ptr<Expert>(const mjModel& model, const model_info_t& info);
MakeTaskExpert MakeCubeHandoverExpert, MakePackBoxExpert, MakeRotateValveExpert, MakeStackTwoBlocksExpert;
std::unique_ptr<Expert> MakeLiftByHandlesExpert(const HandledObject& object, const mjModel& model,
                                                const model_info_t& info);
// Creates the expert of the tasks stack_single_book_shelf (to_shelf) and pick_single_book_from_table.
std::unique_ptr<Expert> MakeSingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info);

}  // namespace evalbus::policy
