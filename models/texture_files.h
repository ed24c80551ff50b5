// PNG files of the textures that a randomization may choose in addition to the textures of the scene
// (docs/adding_a_task.md).
#pragma once

#include <filesystem>

#include "models/randomization.h"

namespace evalbus {

// Choice that removes the texture.
inline constexpr char kPlain[] = "plain";

// Returns the file of a texture that the scene does not have. The choice is the name of a texture in
// models/textures, or a file name that ends in ".png". The latter is relative to the task's folder or, if it
// does not exist there, to the folder of the shipped tasks. Throws InputError at the choice's line.
std::filesystem::path TextureFile(const NameInFile& choice, const std::filesystem::path& task_folder);

}  // namespace evalbus
