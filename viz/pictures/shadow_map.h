// The map of what a light reaches: depths from it, drawn into MuJoCo's own map as MuJoCo does.
#pragma once

#include <mujoco/mujoco.h>

#include "viz/pictures/gl_functions.h"
#include "viz/pictures/gl_math.h"
#include "viz/pictures/scene_geoms.h"

namespace evalbus::viz {

// From the world to a place in the map, each coordinate from 0 to 1.
using ShadowFromWorld = Matrix;

// light: directional. Leaves OpenGL's matrices, viewport and framebuffer as they come; colours are drawn
// again afterwards, and backs culled.
ShadowFromWorld DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                              const mjvScene& scene, const mjvLight& light);

}  // namespace evalbus::viz
