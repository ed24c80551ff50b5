// Draws what mjr_render draws, in fewer passes: where MuJoCo draws everything three times (lights without a
// shadow, the shadow map, the light with a shadow), this draws the shadow map once per state, whatever the
// number of cameras, and everything else once. Uses MuJoCo's own triangles, textures and buffers, the
// lighting of OpenGL's fixed functions and, in the same order of passes, what MuJoCo 2.2.2 does with them.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

namespace evalbus::viz {

class ScenePainter {
 public:
  // context: made by mjr_makeContext in the OpenGL context that is current, here and in every call. Throws
  // EnvironmentError where that OpenGL is too old.
  ScenePainter(const mjModel& model, const mjrContext& context);
  ~ScenePainter();
  ScenePainter(const ScenePainter&) = delete;
  ScenePainter& operator=(const ScenePainter&) = delete;

  // Whether Paint knows everything that is in this scene; what it does not know (mirrors, fog, spot lights,
  // skins, two lights with shadows) is for mjr_render.
  static bool Knows(const mjvScene& scene, const mjrContext& context);
  // Into the lower left corner of the offscreen buffer. is_fixed: the camera stands still, so that its
  // picture of what does not move is kept; this may round otherwise, so say it of a camera always or never.
  // keep_shadows: the bodies and lights are where they were at the last call that had shadows.
  void Paint(mjrRect view, const mjvScene& scene, bool is_fixed, bool keep_shadows);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus::viz
