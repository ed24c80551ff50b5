// The scene of a run: composed and compiled once. Its models are written to files for all processes of the
// run.
#pragma once

#include "models/scene.h"
#include "sim/sim_options.h"

namespace evalbus::sim {

struct PreparedScene {
  // The task with its variation applied.
  TaskDescription task;
  std::string variation;
  RobotDescription robot;
  Scene scene;
  // Complete MODEL. The file names are empty if no files were written.
  model_info_t info{};
  // Contents of the two model files. Empty if the models were loaded from files.
  std::string physics_file, visual_file;
};

// Throws InputError for errors in the task, the robot or their models.
PreparedScene ComposeScene(const SimOptions& options);

// Writes RUN/model/. Throws EnvironmentError.
void WriteModels(const PreparedScene& composed, const std::filesystem::path& run);

// Prepares the scene for a sim: composes it and writes its models, or loads the models whose digests the
// options contain. Throws InputError if these are missing or differ, and EnvironmentError.
PreparedScene PrepareScene(const SimOptions& options);

}  // namespace evalbus::sim
