// Draws with MuJoCo's mjr_render into the lower left corner of MuJoCo's offscreen buffer. The buffer must be
// large enough for the image.
#pragma once

#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/painter.h"

namespace evalbus::viz {

class MujocoPainter : public Painter {
 public:
  // context: created by mjr_makeContext. Throws EnvironmentError if OpenGL has no glReadPixels.
  explicit MujocoPainter(const mjrContext& context);

  bool Supports(const mjvScene&) const override { return true; }
  std::unique_ptr<PaintedImage> NewImage(int width, int height) const override;
  Part Paint(const mjvScene& scene, PaintedImage* image) override;

 private:
  const mjrContext& context_;
  decltype(glReadPixels)* read_pixels_;
};

}  // namespace evalbus::viz
