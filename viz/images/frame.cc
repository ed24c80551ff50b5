#include "viz/images/frame.h"

#include <fmt/format.h>

#include <cstdio>

#include "base/errors.h"

namespace evalbus::viz {

FrameSize ParseFrameSize(const std::string& text) {
  FrameSize size;
  int used = 0;
  if (std::sscanf(text.c_str(), "%9dx%9d%n", &size.width, &size.height, &used) != 2 ||
      used != static_cast<int>(text.size())) {
    throw InputError("--size " + text + ": expected WIDTHxHEIGHT, for example 1280x720");
  }
  return size;
}

void CheckFrameSize(FrameSize size) {
  // OSMesa supports up to 10922 pixels per side. The lower limit bounds the memory use.
  constexpr int kMaxPixels = 4096;
  const auto usable = [](int pixels) { return pixels >= 2 && pixels <= kMaxPixels && pixels % 2 == 0; };
  if (!usable(size.width) || !usable(size.height)) {
    throw InputError(fmt::format("images of {}x{}: expected even numbers of pixels, 2 to {} per side",
                                 size.width, size.height, kMaxPixels));
  }
}

}  // namespace evalbus::viz
