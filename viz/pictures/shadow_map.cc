#include "viz/pictures/shadow_map.h"

#include <cmath>

namespace evalbus::viz {

ShadowFromWorld DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                              const mjvScene& scene, const mjvLight& light) {
  const float clip = context.shadowClip, near = scene.camera[0].frustum_near,
              far = scene.camera[0].frustum_far;
  const Vec direction = Of(light.dir);
  Vec up = Cross(direction, {-1, 0, 0});
  if (Dot(up, up) <= 0.01f) up = Cross(direction, {0, 1, 0});
  const Matrix light_from_world = LookAlong(Of(light.pos), direction, up);
  Matrix projection{};
  projection[0] = projection[5] = 1 / clip;
  projection[10] = -2 / (far - near);
  projection[14] = -(far + near) / (far - near);
  projection[15] = 1;
  const Matrix halve = {0.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0, 0.5f, 0.5f, 0.5f, 1};

  gl.BindFramebuffer(GL_FRAMEBUFFER, context.shadowFBO);
  gl.DrawBuffer(GL_NONE);
  // The edge stays empty: what is outside of the map has no shadow.
  gl.Viewport(1, 1, context.shadowSize - 2, context.shadowSize - 2);
  gl.Clear(GL_DEPTH_BUFFER_BIT);
  gl.ColorMask(0, 0, 0, 0);
  gl.CullFace(GL_FRONT);
  gl.MatrixMode(GL_PROJECTION);
  gl.LoadMatrixf(projection.data());
  gl.MatrixMode(GL_MODELVIEW);
  gl.LoadMatrixf(light_from_world.data());
  const Vec right = TurnBack(light_from_world, {1, 0, 0}), above = TurnBack(light_from_world, {0, 1, 0});
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (geom.category == mjCAT_DECOR) continue;
    const Vec centre = Of(geom.pos) - Of(light.pos);
    const float reach = clip + geom.modelrbound;
    const bool is_outside = geom.modelrbound > 0 &&
                            (std::abs(Dot(right, centre)) > reach || std::abs(Dot(above, centre)) > reach);
    if (!is_outside) geoms.Draw(geom);
  }
  gl.CullFace(GL_BACK);
  gl.ColorMask(1, 1, 1, 1);
  return halve * projection * light_from_world;
}

}  // namespace evalbus::viz
