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

// From "640x480". Throws InputError.
FrameSize ParseFrameSize(const std::string& text);
// Throws InputError for an odd or absurd size.
void CheckFrameSize(FrameSize size);

// Rows from the top, pixels from the left, 4 bytes each: blue, green, red, unused. (Cairo's RGB24 on a
// little-endian machine and ffmpeg's bgr0, so that no pixel is converted twice.)
struct Frame {
  explicit Frame(FrameSize s) : size(s), bgrx(size_t(s.width) * size_t(s.height) * 4) {}

  FrameSize size;
  std::vector<uint8_t> bgrx;
};

}  // namespace evalbus::viz
