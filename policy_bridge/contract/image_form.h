// Converts a camera image to the form that a policy was trained on.
#pragma once

#include <cstdint>
#include <span>

#include "evalbus/image_t.hpp"
#include "evalbus/view_t.hpp"
#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

struct ImageForm {
  // View to render: camera, size, field of view and shadows.
  view_t view{};
  // The rendered image is processed in the order of the members below: it is rotated counter-clockwise and
  // mirrored left to right.
  int rotate_deg = 0;  // 0, 90, 180, 270
  bool mirror = false;
  // Then it is resized (0: keeps the rendered size). pad: keeps the aspect ratio and adds black bars;
  // otherwise the image is stretched.
  int width_px = 0, height_px = 0;
  bool pad = true;
  // Finally it is converted from RGB to BGR, and from (H, W, 3) to (3, H, W).
  bool bgr = false;
  bool chw = false;
};

// Returns the array for the policy: "|u1" (H, W, 3) or (3, H, W); for depth "<f4" (H, W), m. Throws
// std::runtime_error unless `image` is a rendering of form.view.
Array FormImage(const ImageForm& form, const image_t& image);

// Resizes pixels of `channels` bytes each, with the same result as Pillow's Image.resize with BILINEAR. This
// is a triangle filter, which is wider if the image shrinks. It is applied along rows, then along columns,
// and each pass rounds to integer levels.
std::vector<uint8_t> Resize(std::span<const uint8_t> pixels, int width, int height, int channels,
                            int to_width, int to_height);

}  // namespace evalbus::policy
