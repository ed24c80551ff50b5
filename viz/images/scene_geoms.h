// The triangles of a scene's geoms and of its sky: MuJoCo's own lists of them, in mjrContext.
#pragma once

#include <mujoco/mujoco.h>

#include "viz/images/gl_functions.h"
#include "viz/images/gl_math.h"

namespace evalbus::viz {

class SceneGeoms {
 public:
  SceneGeoms(const GlFunctions& gl, const mjrContext& context) : gl_(gl), context_(context) {}

  // Whether this MuJoCo has the lists that we know.
  static bool Knows(const mjrContext& context);
  // Where it stands, if the current matrix is the world's.
  void Draw(const mjvGeom& geom) const;
  // A cylinder around a place.
  void DrawSky(Vec place, float distance) const;

 private:
  const GlFunctions& gl_;
  const mjrContext& context_;
};

}  // namespace evalbus::viz
