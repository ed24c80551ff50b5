// PNG encoder for frames (Cairo).
#pragma once

#include <filesystem>

#include "viz/images/frame.h"

namespace evalbus::viz {

// Writes a PNG file. Throws InputError if the file cannot be written.
void WritePng(const Frame& frame, const std::filesystem::path& file);

}  // namespace evalbus::viz
