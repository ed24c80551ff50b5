// Draws scenes into images. There are two painters: ScenePainter (evalbus' own) and MujocoPainter (MuJoCo's
// mjr_render). The environment variable EVALBUS_PAINTER selects one (docs/design/0002-own-painter.md). The
// OpenGL context must be current in every call, including destruction.
#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "viz/images/painter/scene_changes.h"

namespace evalbus::viz {

// kPlain: for policies. Both painters draw the same image. kVideo: for people. If ScenePainter draws the
// scene, it has soft shadows, one more fill light, and a floor that fades into the sky.
enum class Look { kPlain, kVideo };

// An image that its painter updates. Must be destroyed before its painter.
class PaintedImage {
 public:
  PaintedImage(int width_pixels, int height_pixels)
      : width(width_pixels),
        height(height_pixels),
        rgba(static_cast<size_t>(width) * static_cast<size_t>(height) * 4) {}
  virtual ~PaintedImage() = default;
  PaintedImage(const PaintedImage&) = delete;
  PaintedImage& operator=(const PaintedImage&) = delete;

  const int width, height;
  // Pixels of four bytes, in rows from the bottom to the top.
  std::vector<uint8_t> rgba;
};

class Painter {
 public:
  virtual ~Painter() = default;

  // Returns whether Paint can draw everything in this scene.
  virtual bool Supports(const mjvScene& scene) const = 0;
  // Throws EnvironmentError if OpenGL does not support an image of this size.
  virtual std::unique_ptr<PaintedImage> NewImage(int width, int height) const = 0;
  // Updates an image that NewImage of this painter has created. Returns the part that has changed.
  virtual Part Paint(const mjvScene& scene, PaintedImage* image) = 0;
};

// Returns true if EVALBUS_PAINTER is "mujoco", and false if it is "evalbus" or unset. Throws InputError for
// other values.
bool MujocoPaints();

}  // namespace evalbus::viz
