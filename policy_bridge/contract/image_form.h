// How a camera's image is made into what a policy was trained on.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "evalbus/image_t.hpp"
#include "evalbus/view_t.hpp"
#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

struct ImageForm {
  // Drawn so: camera, size, field of view, shadows.
  view_t view{};
  // Then, in this order: turned counter-clockwise by this, mirrored left to right, brought to this size, ...
  int rotate_deg = 0;  // 0, 90, 180, 270
  bool mirror = false;
  // 0: as it was drawn. Pad: keeps the shape, with black bars; else stretched.
  int width_px = 0, height_px = 0;
  bool pad = true;
  // ... blue first instead of red, planes before rows instead of after columns.
  bool bgr = false;
  bool chw = false;
};

// The array that the policy sees, "|u1" (H, W, 3) or (3, H, W); of depth "<f4" (H, W), m. image: what
// form.view asks for. Throws std::runtime_error if it is not.
Array FormImage(const ImageForm& form, const image_t& image);

// Pixels of `channels` bytes each to another size, as Pillow's Image.resize with BILINEAR does: a triangle
// filter that widens as the image shrinks, columns first, each pass rounded to whole levels.
std::vector<uint8_t> Resize(std::span<const uint8_t> pixels, int width, int height, int channels,
                            int to_width, int to_height);

}  // namespace evalbus::policy
