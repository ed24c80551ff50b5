#include "viz/images/painter/outlines.h"

#include <algorithm>
#include <array>
#include <utility>

namespace evalbus::viz {
namespace {

// Offsets to the neighbors within kOutlinePixels of a pixel, which form a disk.
constexpr std::array<std::pair<int, int>, 12> kNeighbors = {
    {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}, {-2, 0}, {2, 0}, {0, -2}, {0, 2}}};
static_assert(kOutlinePixels == 2);

}  // namespace

Part WithOutlines(Part part, const PaintedImage& image) {
  if (part.is_empty()) return part;
  return {std::max(0, part.left - kOutlinePixels), std::max(0, part.bottom - kOutlinePixels),
          std::min(image.width, part.right + kOutlinePixels),
          std::min(image.height, part.top + kOutlinePixels)};
}

void DrawOutlines(const Part& part, PaintedImage* image) {
  const auto pixel = [image](int x, int y) {
    return &image->rgba[4 * (static_cast<size_t>(y) * static_cast<size_t>(image->width) +
                             static_cast<size_t>(x))];
  };
  const auto is_outlined = [&](int x, int y) { return pixel(x, y)[3] < 128; };
  // Pixels at the border of the image get no outline, so no neighbor is outside the image.
  const int left = std::max(part.left, kOutlinePixels), bottom = std::max(part.bottom, kOutlinePixels),
            right = std::min(part.right, image->width - kOutlinePixels),
            top = std::min(part.top, image->height - kOutlinePixels);
  for (int y = bottom; y < top; ++y) {
    for (int x = left; x < right; ++x) {
      if (is_outlined(x, y)) continue;
      if (std::ranges::any_of(kNeighbors,
                              [&](auto to) { return is_outlined(x + to.first, y + to.second); })) {
        std::fill_n(pixel(x, y), 3, uint8_t{255});
      }
    }
  }
}

}  // namespace evalbus::viz
