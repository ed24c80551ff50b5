// Compiled models of a run, which its processes share as files. MODEL contains the files' names and hashes.
#pragma once

#include <filesystem>

#include "evalbus/model_info_t.hpp"
#include "models/mujoco_ptr.h"

namespace evalbus {

// Throws InputError if the message version of the evalbus that made the run is incompatible with this one.
void CheckMessageVersion(const model_info_t& info);

// Throws InputError if the file cannot be read, its SHA-256 differs, or it is not a compiled model of this
// MuJoCo version.
ModelPtr LoadModel(const std::filesystem::path& file, const std::string& sha256);

// Loads info.physics_file. Throws InputError if it is not a model file of a run, cannot be read, does not
// have MODEL's SHA-256, or is not the model that MODEL describes.
ModelPtr LoadPhysicsModel(const model_info_t& info);
// Loads info.visual_file. Throws the errors of LoadPhysicsModel(), but does not compare the model with
// MODEL's numbers of bodies, geoms and coordinates.
ModelPtr LoadVisualModel(const model_info_t& info);

// Sets the paths in `info` to the model files in a run's folder, which may have been moved or copied since
// MODEL was published. If a file is missing there, keeps the path of MODEL.
void UseModelsIn(const std::filesystem::path& run, model_info_t* info);

}  // namespace evalbus
