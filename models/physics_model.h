// The compiled models of a run, as its processes share them: files, named with their hashes in MODEL.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

#include "evalbus/model_info_t.hpp"

namespace evalbus {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using ModelPtr = std::unique_ptr<mjModel, ModelDeleter>;

// Throws InputError if the run was made by an evalbus whose messages mean something else.
void CheckMessageVersion(const model_info_t& info);

// Loads info.physics_file. Throws InputError if that is not the name of a run's model, cannot be read, is not
// the one that MODEL's SHA-256 stands for or not the one that MODEL describes.
ModelPtr LoadPhysicsModel(const model_info_t& info);
// The same for info.visual_file.
ModelPtr LoadVisualModel(const model_info_t& info);

// MuJoCo's own answers to trouble are to wait for a key and to write a file into the working folder. From now
// on its errors are EnvironmentErrors and its warnings lines on stderr.
void InstallMujocoHandlers();

}  // namespace evalbus
