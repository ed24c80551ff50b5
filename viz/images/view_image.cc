#include "viz/images/view_image.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <vector>

#include "base/errors.h"

namespace evalbus::viz {
namespace {

constexpr char kColor[] = "rgb8", kDepth[] = "depth32";
constexpr int kMaxPixels = 2048;

}  // namespace

void CheckView(const view_t& view, const mjModel& model) {
  FindCamera(model, view.camera);
  const auto is_good = [](int pixels) { return pixels >= 1 && pixels <= kMaxPixels; };
  if (!is_good(view.width_px) || !is_good(view.height_px)) {
    throw InputError(fmt::format("an image of {}x{}: expected 1 to {} pixels per side", view.width_px,
                                 view.height_px, kMaxPixels));
  }
  if (view.fovy_deg != 0 && !(view.fovy_deg >= 1 && view.fovy_deg <= 170)) {
    throw InputError(fmt::format(
        "a field of view of {}: expected 1 to 170 degrees, or 0 for the camera's own", view.fovy_deg));
  }
  if (view.encoding != kColor && view.encoding != kDepth) {
    throw InputError(fmt::format("encoding '{}': expected {} or {}", view.encoding, kColor, kDepth));
  }
}

void DrawView(const view_t& view, const header_t& header, Renderer* renderer, image_t* image) {
  image->header = header;
  image->view = view;
  const Shot shot{FindCamera(renderer->model(), view.camera),
                  {view.width_px, view.height_px},
                  view.fovy_deg,
                  view.shadows != 0};
  if (view.encoding == kColor) {
    renderer->RenderRgb(shot, &image->data);
  } else {
    static_assert(std::endian::native == std::endian::little);
    std::vector<float> depth_m;
    renderer->RenderDepth(shot, &depth_m);
    image->data.resize(depth_m.size() * sizeof(float));
    std::memcpy(image->data.data(), depth_m.data(), image->data.size());
  }
  image->num_bytes = static_cast<int32_t>(image->data.size());
}

}  // namespace evalbus::viz
