// Frames as JPEG, by libjpeg-turbo.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "viz/images/frame.h"

namespace evalbus::viz {

class JpegEncoder {
 public:
  // Throws EnvironmentError if the library refuses; so does Encode.
  JpegEncoder();

  // A file of its own: JFIF, 4:2:0, good enough to read the overlay.
  std::vector<uint8_t> Encode(const Frame& frame);

 private:
  std::unique_ptr<void, int (*)(void*)> encoder_;
};

}  // namespace evalbus::viz
