// The scripted experts, each in a file of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

struct HandledObject {
  // Object of the task. Its file has the sites left_handle and right_handle in the middle of two bars along
  // the object's x axis, on +y and -y.
  std::string name;
  // Position that both arms reach best. A dragged object is moved by one of these fractions of the distance
  // to it: the first one that allows a lift.
  Eigen::Vector2d sweet_spot;  // m
  std::vector<double> drags;
  // If the object's origin is farther to the left (+y) than this (m), it is dragged first.
  double max_y;
};

// Each throws InputError if the model lacks what the expert handles, or does not have enough arms.
using MakeTaskExpert = std::unique_ptr<Expert>(const mjModel& model, const model_info_t& info);
MakeTaskExpert MakeCubeHandoverExpert, MakePackBoxExpert, MakeRotateValveExpert, MakeStackTwoBlocksExpert;
std::unique_ptr<Expert> MakeLiftByHandlesExpert(const HandledObject& object, const mjModel& model,
                                                const model_info_t& info);
// For the tasks stack_single_book_shelf and pick_single_book_from_table.
std::unique_ptr<Expert> MakeSingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info);

}  // namespace evalbus::policy
