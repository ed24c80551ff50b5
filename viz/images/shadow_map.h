// The map of what a light reaches: depths from it, drawn into MuJoCo's own map as MuJoCo does.
#pragma once

#include <mujoco/mujoco.h>

#include "viz/images/gl_functions.h"
#include "viz/images/gl_math.h"
#include "viz/images/scene_changes.h"
#include "viz/images/scene_geoms.h"

namespace evalbus::viz {

// light: directional.
LightView LightViewOf(const mjrContext& context, const mjvLight& light);

// From the world to a place in the map, each coordinate from 0 to 1.
Matrix ShadowFromWorld(const LightView& light, const mjvScene& scene);

// Only this part of the map, which is not empty; the rest stays. Leaves OpenGL's matrices, viewport, scissors
// and framebuffer as they come; colors are drawn again afterwards, and backs culled.
void DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                   const mjvScene& scene, const LightView& light, const Part& part);

}  // namespace evalbus::viz
