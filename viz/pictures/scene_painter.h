// Draws what mjr_render draws, in fewer passes: where MuJoCo draws everything three times (lights without a
// shadow, the shadow map, the light with a shadow), this draws the shadow map once per state, whatever the
// number of cameras, and everything else once. Uses MuJoCo's own triangles, textures and buffers, the
// lighting of OpenGL's fixed functions and, in the same order of passes, what MuJoCo 2.2.2 does with them.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <functional>

#include "viz/pictures/gl_functions.h"
#include "viz/pictures/gl_math.h"
#include "viz/pictures/scene_geoms.h"
#include "viz/pictures/scene_shaders.h"

namespace evalbus::viz {

class ScenePainter {
 public:
  // context: made by mjr_makeContext in the OpenGL context that is current, here and in every call. Throws
  // EnvironmentError where that OpenGL is too old.
  explicit ScenePainter(const mjrContext& context);

  // Whether Paint knows everything that is in this scene; what it does not know (mirrors, fog, spot lights,
  // skins, two lights with shadows) is for mjr_render.
  static bool Knows(const mjvScene& scene, const mjrContext& context);
  // Into the lower left corner of the offscreen buffer. keep_shadows: the bodies and lights are where they
  // were at the last call that had shadows.
  void Paint(mjrRect view, const mjvScene& scene, bool keep_shadows);

 private:
  SceneLights LightsOf(const mjvScene& scene, int shadow_light, Vec forward, const Matrix& eye_from_world);
  void PaintOpaque(const mjvScene& scene, bool with_shadow,
                   const std::function<bool(const mjvGeom&)>& wanted);
  void PaintTransparent(const mjvScene& scene);
  void PaintSky(float far);
  void Paint(const mjvGeom& geom, bool with_shadow);
  void PlaceTexture(const SceneShaders::Program& program, const mjvGeom& geom, bool is_cube);
  // A plane that is seen from behind.
  bool IsBehind(const mjvGeom& geom) const;
  bool IsOpaque(const mjvGeom& geom) const { return geom.rgba[3] >= 0.995f && !IsBehind(geom); }
  // Whether nothing of it can be in the picture.
  bool IsOutside(const mjvGeom& geom) const;

  const GlFunctions gl_;
  const mjrContext& context_;
  SceneGeoms geoms_{gl_, context_};
  SceneShaders shaders_{gl_};
  // The sky's texture; -1: none.
  int sky_ = -1;
  Matrix shadow_from_world_{};

  // Of the picture that is being drawn.
  Vec eye_{};
  // Outwards, of the picture's four edges.
  std::array<Vec, 4> sides_{};
};

}  // namespace evalbus::viz
