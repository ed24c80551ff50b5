// PNG files of the textures that a randomization may choose besides those of the scene
// (docs/adding_a_task.md).
#pragma once

#include <filesystem>

#include "models/randomization.h"

namespace evalbus {

// Choice that removes the texture.
inline constexpr char kPlain[] = "plain";

// Returns the file of a texture that the scene does not have: one of models/textures by its name, or a file
// that ends in ".png", relative to the task's folder or else to that of the shipped tasks. Throws InputError
// at the choice's line.
std::filesystem::path TextureFile(const NameInFile& choice, const std::filesystem::path& task_folder);

}  // namespace evalbus
