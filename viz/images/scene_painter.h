// Draws what mjr_render draws, in fewer passes: where MuJoCo draws everything three times (lights without a
// shadow, the shadow map, the light with a shadow), this draws the shadow map once per state, whatever the
// number of cameras, and everything else once; and of a map or an image that was drawn before, only the part
// that can have changed since, which gives the same bytes. Uses MuJoCo's own triangles, textures and buffers,
// the lighting of OpenGL's fixed functions and, in the same order of passes, what MuJoCo 2.2.2 does with
// them.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "viz/images/gl_functions.h"
#include "viz/images/gl_math.h"
#include "viz/images/scene_changes.h"
#include "viz/images/scene_geoms.h"
#include "viz/images/scene_shaders.h"

namespace evalbus::viz {

// An image that stays where it was drawn, so that the next one of this camera needs to be drawn only where
// it differs. Made, used and freed where the painter's OpenGL context is current.
class KeptImage {
 public:
  // gl: the painter's. Throws EnvironmentError where OpenGL has no such buffer.
  KeptImage(const GlFunctions& gl, int width, int height);
  ~KeptImage();
  KeptImage(const KeptImage&) = delete;
  KeptImage& operator=(const KeptImage&) = delete;

  const int width, height;
  // Rows from the bottom, four bytes a pixel.
  std::vector<uint8_t> rgba;

 private:
  friend class ScenePainter;

  void Free();

  const GlFunctions& gl_;
  GLuint framebuffer_ = 0, renderbuffers_[2] = {0, 0};
  std::optional<DrawnScene> shows_;
};

class ScenePainter {
 public:
  // context: made by mjr_makeContext in the OpenGL context that is current, here and in every call. Throws
  // EnvironmentError where that OpenGL is too old.
  ScenePainter(const mjrContext& context, const mjModel& model);

  const GlFunctions& gl() const { return gl_; }
  // Whether Paint knows everything that is in this scene; what it does not know (mirrors, fog, spot lights,
  // skins, two lights with shadows) is for mjr_render.
  static bool Knows(const mjvScene& scene, const mjrContext& context);
  // Brings the image up to date; returns what of it is new.
  Part Paint(const mjvScene& scene, KeptImage* image);
  // Something else has drawn into MuJoCo's map of shadows.
  void ForgetShadows() { map_shows_.reset(); }

 private:
  // The map of shadows is that of this scene from now on.
  void PaintShadows(const mjvScene& scene, const LightView& light);
  void PaintPart(const mjvScene& scene, bool with_shadow, float far);
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
  // Whether nothing of it can be in the image.
  bool IsOutside(const mjvGeom& geom) const;

  const GlFunctions gl_;
  const mjrContext& context_;
  const GeomBoxes boxes_;
  SceneGeoms geoms_{gl_, context_};
  SceneShaders shaders_{gl_};
  // The sky's texture; -1: none.
  int sky_ = -1;
  Matrix shadow_from_world_{};
  // What the map of shadows is of.
  std::optional<DrawnScene> map_shows_;

  // Of the image that is being drawn.
  Vec eye_{};
  // Outwards, of the four edges of what is drawn.
  std::array<Vec, 4> sides_{};
};

}  // namespace evalbus::viz
