// The shadow map contains depths as seen from a light. It is drawn into MuJoCo's map in the same way as
// MuJoCo does.
#pragma once

#include <mujoco/mujoco.h>

#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/gl_math.h"
#include "viz/images/painter/scene_changes.h"
#include "viz/images/painter/scene_geoms.h"

namespace evalbus::viz {

// Returns the view of a light, which must be directional.
LightView LightViewOf(const mjrContext& context, const mjvLight& light);

// Returns the transform from the world frame to shadow map coordinates, which are from 0 to 1.
Matrix ShadowFromWorld(const LightView& light, const mjvScene& scene);

// Draws only `part` of the map, which must not be empty. Does not restore OpenGL's matrices, viewport,
// scissor box and framebuffer. On return, color writes and back-face culling are enabled.
void DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                   const mjvScene& scene, const LightView& light, const Part& part);

}  // namespace evalbus::viz
