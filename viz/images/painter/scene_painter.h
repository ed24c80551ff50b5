// Draws the same image as mjr_render in fewer passes. MuJoCo draws everything three times: for the lights
// without a shadow, for the shadow map, and for the light with a shadow. ScenePainter draws the shadow map
// once per state for all cameras, and everything else once. If a shadow map or image has been drawn before,
// only the part that can have changed is redrawn. The bytes are the same as if everything were redrawn.
// ScenePainter uses MuJoCo's triangles, textures and buffers, the lighting of OpenGL's fixed-function
// pipeline, and the pass order of MuJoCo 2.2.2.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/gl_math.h"
#include "viz/images/painter/painter.h"
#include "viz/images/painter/scene_changes.h"
#include "viz/images/painter/scene_geoms.h"
#include "viz/images/painter/scene_shaders.h"

namespace evalbus::viz {

// An image that is kept in its framebuffer. For the next image of the same camera, only the changed part must
// be drawn.
class KeptImage : public PaintedImage {
 public:
  // gl: the painter's functions. Throws EnvironmentError if OpenGL does not support such a buffer.
  KeptImage(const GlFunctions& gl, int width, int height);
  ~KeptImage() override;

 private:
  friend class ScenePainter;

  void Free();

  const GlFunctions& gl_;
  GLuint framebuffer_ = 0, renderbuffers_[2] = {0, 0};
  std::optional<DrawnScene> shows_;
};

class ScenePainter : public Painter {
 public:
  // context: created by mjr_makeContext. The OpenGL context must be current here and in every call. Throws
  // EnvironmentError if its OpenGL version is too old. outlined_bodies: for each body id, whether the opaque
  // geoms of the body are outlined. Empty: no geoms are outlined.
  ScenePainter(const mjrContext& context, const mjModel& model, Look look,
               const std::vector<bool>& outlined_bodies = {});

  // Returns false for scenes that this painter cannot draw, for example scenes with mirrors, fog, spot
  // lights, skins, endless planes or two lights with shadows.
  bool Supports(const mjvScene& scene) const override;
  std::unique_ptr<PaintedImage> NewImage(int width, int height) const override;
  Part Paint(const mjvScene& scene, PaintedImage* image) override;
  // Must be called after other code has drawn into MuJoCo's shadow map.
  void ForgetShadows() { map_shows_.reset(); }

 private:
  // Updates the shadow map to this scene.
  void PaintShadows(const mjvScene& scene, const LightView& light);
  void PaintPart(const mjvScene& scene, bool with_shadow, float far);
  SceneLights LightsOf(const mjvScene& scene, int shadow_light, Vec forward, const Matrix& eye_from_world);
  void PaintOpaque(const mjvScene& scene, bool with_shadow,
                   const std::function<bool(const mjvGeom&)>& wanted);
  void PaintTransparent(const mjvScene& scene);
  void PaintSky(float far);
  void BindSky();
  void Paint(const mjvGeom& geom, bool with_shadow);
  // Sets the direction from the eye to each point of a floor, in the coordinates of the sky's texture.
  void PlaceSky(const SceneShaders::Program& program, const mjvGeom& geom);
  // Returns whether the geom's edge fades into the sky.
  bool FadesIntoSky(const mjvGeom& geom) const;
  void PlaceTexture(const SceneShaders::Program& program, const mjvGeom& geom, bool is_cube);
  // Returns whether the geom is a plane that is seen from behind.
  bool IsBehind(const mjvGeom& geom) const;
  bool IsOpaque(const mjvGeom& geom) const { return geom.rgba[3] >= 0.995f && !IsBehind(geom); }
  // Returns whether the geom is certainly outside the view frustum.
  bool IsOutside(const mjvGeom& geom) const;

  const GlFunctions gl_;
  const mjrContext& context_;
  const GeomBoxes boxes_;
  const Look look_;
  // One entry per geom id; empty if no geoms are outlined.
  std::vector<bool> is_outlined_;
  SceneGeoms geoms_{gl_, context_};
  SceneShaders shaders_;
  // Index of the sky's texture; -1 if there is none.
  int sky_ = -1;
  Matrix shadow_from_world_{};
  // The scene from which the shadow map was drawn.
  std::optional<DrawnScene> map_shows_;

  // Eye position of the current image.
  Vec eye_{};
  // Outward normals of the four side planes of the view frustum of the drawn part.
  std::array<Vec, 4> sides_{};
};

}  // namespace evalbus::viz
