// Converts a camera image to the form that a policy was trained on.
#pragma once

#include <cstdint>
#include <span>

#include "evalbus/image_t.hpp"
#include "evalbus/view_t.hpp"
#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

struct ImageForm {
  // View to render: camera, size, field of view, shadows.
  view_t view{};
  // The image is then processed in this order: rotated counter-clockwise, mirrored left to right, resized,
  // ...
  int rotate_deg = 0;  // 0, 90, 180, 270
  bool mirror = false;
  // 0: size as rendered. pad: keeps the aspect ratio and adds black bars; otherwise the image is stretched.
  int width_px = 0, height_px = 0;
  bool pad = true;
  // ... converted from RGB to BGR, and from (H, W, 3) to (3, H, W).
  bool bgr = false;
  bool chw = false;
};

// Returns the array for the policy: "|u1" (H, W, 3) or (3, H, W); for depth "<f4" (H, W), m. `image` must be
// a rendering of form.view; throws std::runtime_error if it is not.
Array FormImage(const ImageForm& form, const image_t& image);

// Resizes pixels of `channels` bytes each, with the same result as Pillow's Image.resize with BILINEAR: a
// triangle filter that widens when the image shrinks, applied along each row first, with each pass rounded to
// integer levels.
std::vector<uint8_t> Resize(std::span<const uint8_t> pixels, int width, int height, int channels,
                            int to_width, int to_height);

}  // namespace evalbus::policy
