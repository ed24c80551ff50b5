// JPEG encoder for frames (libjpeg-turbo).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "viz/images/frame.h"

namespace evalbus::viz {

class JpegEncoder {
 public:
  // Both the constructor and Encode throw EnvironmentError if the library fails.
  JpegEncoder();

  // Returns a complete JFIF file (4:2:0 subsampling). The quality is high enough to keep the overlay
  // readable.
  std::vector<uint8_t> Encode(const Frame& frame);

 private:
  std::unique_ptr<void, int (*)(void*)> encoder_;
};

}  // namespace evalbus::viz
