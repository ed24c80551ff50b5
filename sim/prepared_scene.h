// The scene of a run. It is composed and compiled once, and its models are written to files for all processes
// of the run.
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

// Throws InputError for errors in the options, the task, the robot or their models, and EnvironmentError if a
// file cannot be read.
PreparedScene ComposeScene(const SimOptions& options);

// Writes RUN/model/. Throws the errors of WriteWhole() (base/write_whole.h).
void WriteModels(const PreparedScene& composed, const std::filesystem::path& run);

// Prepares the scene for a sim. If the options contain digests of models, loads the models with these
// digests; otherwise composes the scene and writes its models. Throws InputError if a model is missing or its
// digest differs, and EnvironmentError if a file cannot be read or written.
PreparedScene PrepareScene(const SimOptions& options);

}  // namespace evalbus::sim
