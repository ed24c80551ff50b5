// The scene of a run: found, composed, compiled, and its models written for the others.
#pragma once

#include "models/scene.h"
#include "sim/sim_options.h"

namespace evalbus::sim {

struct PreparedScene {
  // As its variation has it.
  TaskDescription task;
  std::string variation;
  RobotDescription robot;
  Scene scene;
  // MODEL, whole; without names of files where none were written.
  model_info_t info{};
};

// Throws InputError for the task, the robot or their models.
PreparedScene ComposeScene(const SimOptions& options);

// The same, and writes OUT/model/. Throws EnvironmentError for the disk.
PreparedScene PrepareScene(const SimOptions& options);

}  // namespace evalbus::sim
