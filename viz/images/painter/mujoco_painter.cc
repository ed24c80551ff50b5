#include "viz/images/painter/mujoco_painter.h"

#include "base/environment_choice.h"

namespace evalbus::viz {

bool MujocoPaints() { return EnvironmentSelects("EVALBUS_PAINTER", "mujoco", "evalbus"); }

MujocoPainter::MujocoPainter(const mjrContext& context)
    : context_(context), read_pixels_(FindGl<decltype(glReadPixels)>("glReadPixels")) {}

std::unique_ptr<PaintedImage> MujocoPainter::NewImage(int width, int height) const {
  return std::make_unique<PaintedImage>(width, height);
}

Part MujocoPainter::Paint(const mjvScene& scene, PaintedImage* image) {
  // MuJoCo 2.2 takes a non-const scene, because it stores the order of transparent geoms there.
  mjr_render({0, 0, image->width, image->height}, const_cast<mjvScene*>(&scene), &context_);
  read_pixels_(0, 0, image->width, image->height, GL_RGBA, GL_UNSIGNED_BYTE, image->rgba.data());
  return {0, 0, image->width, image->height};
}

}  // namespace evalbus::viz
