// The scene of a run: composed and compiled once, and its models written for all of the run's processes.
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
  // The two models as files; empty where they were loaded from those.
  std::string physics_file, visual_file;
};

// Throws InputError for the task, the robot or their models.
PreparedScene ComposeScene(const SimOptions& options);

// Writes RUN/model/. Throws EnvironmentError.
void WriteModels(const PreparedScene& composed, const std::filesystem::path& run);

// For a sim: composes the scene and writes its models, or loads those that the options name. Throws
// InputError where these are not there or others, and EnvironmentError.
PreparedScene PrepareScene(const SimOptions& options);

}  // namespace evalbus::sim
