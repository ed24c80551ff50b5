// Checks that an image from a camera is a complete JPEG file.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace evalbus::sim {

// Returns a description of what is wrong with an image of a camera. Empty if it is a JPEG file of this size
// that can be decoded without a warning. Decodes at an eighth of the size, which takes about a millisecond
// for 640x480.
std::string JpegFault(std::span<const uint8_t> jpeg, int width_px, int height_px);

}  // namespace evalbus::sim
