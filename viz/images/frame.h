// An image in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace evalbus::viz {

struct FrameSize {
  int width = 640;
  int height = 480;

  bool operator==(const FrameSize&) const = default;
};

// Parses a size such as "640x480". Throws InputError if the text is invalid.
FrameSize ParseFrameSize(const std::string& text);
// Throws InputError unless width and height are even and within 2 to 4096 pixels.
void CheckFrameSize(FrameSize size);

// Pixels row by row from the top, left to right, 4 bytes per pixel: blue, green, red, unused. This is Cairo's
// RGB24 on a little-endian machine and ffmpeg's bgr0, so no pixel format conversion is needed.
struct Frame {
  explicit Frame(FrameSize s) : size(s), bgrx(size_t(s.width) * size_t(s.height) * 4) {}

  FrameSize size;
  std::vector<uint8_t> bgrx;
};

}  // namespace evalbus::viz
