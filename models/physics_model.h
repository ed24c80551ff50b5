// The compiled models of a run, as its processes share them: files, named with their hashes in MODEL.
#pragma once

#include <filesystem>

#include "evalbus/model_info_t.hpp"
#include "models/mujoco_ptr.h"

namespace evalbus {

// Throws InputError if the run was made by an evalbus whose messages mean something else.
void CheckMessageVersion(const model_info_t& info);

// Throws InputError where the file cannot be read or has another SHA-256.
ModelPtr LoadModel(const std::filesystem::path& file, const std::string& sha256);

// Loads info.physics_file. Throws InputError if that is not the name of a run's model, cannot be read, is not
// the one that MODEL's SHA-256 stands for or not the one that MODEL describes.
ModelPtr LoadPhysicsModel(const model_info_t& info);
// The same for info.visual_file.
ModelPtr LoadVisualModel(const model_info_t& info);

// Names the models in a run's folder, which may have been moved or copied since MODEL was said; a file that
// is not there leaves what MODEL says.
void UseModelsIn(const std::filesystem::path& run, model_info_t* info);

}  // namespace evalbus
