#include "viz/images/painter/shadow_map.h"

namespace evalbus::viz {
namespace {

Matrix Projection(const LightView& light, const mjvScene& scene) {
  const float near = scene.camera[0].frustum_near, far = scene.camera[0].frustum_far;
  Matrix projection{};
  projection[0] = projection[5] = 1 / light.clip;
  projection[10] = -2 / (far - near);
  projection[14] = -(far + near) / (far - near);
  projection[15] = 1;
  return projection;
}

}  // namespace

LightView LightViewOf(const mjrContext& context, const mjvLight& light) {
  const Vec direction = Of(light.dir);
  Vec up = Cross(direction, {-1, 0, 0});
  if (Dot(up, up) <= 0.01f) up = Cross(direction, {0, 1, 0});
  return {LookAlong(Of(light.pos), direction, up), context.shadowClip, context.shadowSize};
}

Matrix ShadowFromWorld(const LightView& light, const mjvScene& scene) {
  const Matrix halve = {0.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0, 0.5f, 0.5f, 0.5f, 1};
  return halve * Projection(light, scene) * light.light_from_world;
}

void DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                   const mjvScene& scene, const LightView& light, const Part& part) {
  gl.BindFramebuffer(GL_FRAMEBUFFER, context.shadowFBO);
  gl.DrawBuffer(GL_NONE);
  // The border texels stay empty, so that points outside of the map are not in shadow.
  gl.Viewport(1, 1, light.size - 2, light.size - 2);
  gl.Scissor(part.left, part.bottom, part.width(), part.height());
  gl.Enable(GL_SCISSOR_TEST);
  gl.Clear(GL_DEPTH_BUFFER_BIT);
  gl.ColorMask(0, 0, 0, 0);
  gl.CullFace(GL_FRONT);
  gl.MatrixMode(GL_PROJECTION);
  gl.LoadMatrixf(Projection(light, scene).data());
  gl.MatrixMode(GL_MODELVIEW);
  gl.LoadMatrixf(light.light_from_world.data());
  const auto meters = [&](int place) {
    return (2 * static_cast<float>(place - 1) / static_cast<float>(light.size - 2) - 1) * light.clip;
  };
  const float left = meters(part.left), right = meters(part.right), bottom = meters(part.bottom),
              top = meters(part.top);
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (geom.category == mjCAT_DECOR) continue;
    const Vec center = Place(light.light_from_world, Of(geom.pos));
    const float reach = geom.modelrbound;
    const bool is_outside = reach > 0 && (center.x + reach < left || center.x - reach > right ||
                                          center.y + reach < bottom || center.y - reach > top);
    if (!is_outside) geoms.Draw(geom);
  }
  gl.Disable(GL_SCISSOR_TEST);
  gl.CullFace(GL_BACK);
  gl.ColorMask(1, 1, 1, 1);
}

}  // namespace evalbus::viz
