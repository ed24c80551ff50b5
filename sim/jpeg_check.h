// Whether bytes are a whole JPEG file. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace evalbus::sim {

// What is wrong with an image of a camera, in words; empty: it is a JPEG file of this size that decodes
// without a warning. Decodes an eighth of the size, which takes about a millisecond for 640x480.
std::string JpegFault(std::span<const uint8_t> jpeg, int width_px, int height_px);

}  // namespace evalbus::sim
