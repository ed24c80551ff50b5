// Decodes a JPEG image to pixels with libjpeg-turbo.
#pragma once

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <memory>
#include <vector>

#include "viz/images/frame.h"

namespace evalbus::viz {

// If the image cannot be decoded, fails the test and returns a frame of 0 x 0.
inline Frame DecodedJpeg(const std::vector<uint8_t>& jpeg) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), tjDestroy);
  FrameSize size;
  int subsampling = 0, colors = 0;
  if (tjDecompressHeader3(decoder.get(), jpeg.data(), jpeg.size(), &size.width, &size.height, &subsampling,
                          &colors) != 0) {
    ADD_FAILURE() << tjGetErrorStr2(decoder.get());
    return Frame({0, 0});
  }
  Frame frame(size);
  EXPECT_EQ(tjDecompress2(decoder.get(), jpeg.data(), jpeg.size(), frame.bgrx.data(), size.width, 0,
                          size.height, TJPF_BGRX, 0),
            0)
      << tjGetErrorStr2(decoder.get());
  return frame;
}

}  // namespace evalbus::viz
