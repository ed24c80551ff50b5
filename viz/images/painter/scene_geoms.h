// Draws the triangles of a scene's geoms and sky from MuJoCo's display lists in mjrContext.
#pragma once

#include <mujoco/mujoco.h>

#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/gl_math.h"

namespace evalbus::viz {

class SceneGeoms {
 public:
  SceneGeoms(const GlFunctions& gl, const mjrContext& context) : gl_(gl), context_(context) {}

  // Returns whether this MuJoCo version has the expected display lists.
  static bool Supports(const mjrContext& context);
  // Draws the geom at its pose. The current modelview matrix must transform from the world frame.
  void Draw(const mjvGeom& geom) const;
  // Draws the sky as a cylinder around a place.
  void DrawSky(Vec place, float distance) const;

 private:
  const GlFunctions& gl_;
  const mjrContext& context_;
};

}  // namespace evalbus::viz
