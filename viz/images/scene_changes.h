// What can differ between two images by the same camera: where something has moved or looks otherwise, and
// where its shadow was and is. Rather too much than too little. No OpenGL.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <optional>
#include <vector>

#include "viz/images/gl_math.h"

namespace evalbus::viz {

// Of an image or of a map of shadows, in pixels from the lower left corner; right and top are outside.
struct Part {
  int left = 0, bottom = 0, right = 0, top = 0;

  bool is_empty() const { return left >= right || bottom >= top; }
  int width() const { return right - left; }
  int height() const { return top - bottom; }
  bool operator==(const Part&) const = default;
};

// What a scene was when it was drawn.
class DrawnScene {
 public:
  explicit DrawnScene(const mjvScene& scene);

  // Whether geoms alone have changed since: as many of them, one camera, equal lights and settings.
  bool IsComparable(const mjvScene& now) const;
  bool HasAsManyGeoms(const mjvScene& now) const;
  const std::vector<mjvGeom>& geoms() const { return geoms_; }

 private:
  std::vector<mjvGeom> geoms_;
  std::vector<mjvLight> lights_;
  std::array<mjvGLCamera, 2> camera_;
  std::array<mjtByte, mjNRNDFLAG> flags_;
};

// Corners of boxes around shapes.
class GeomBoxes {
 public:
  using Corners = std::array<Vec, 8>;

  explicit GeomBoxes(const mjModel& model);

  // In the world; bit i of a corner's number says which end of the shape's axis i it is at. Nothing for a
  // shape without known bounds.
  std::optional<Corners> Of(const mjvGeom& geom) const;

 private:
  // Of the meshes, about their own axes.
  std::vector<std::array<Vec, 2>> lowest_and_highest_;
};

// An image's camera.
struct EyeView {
  Vec place;
  Matrix clip_from_world;
  int width, height;
};

// The light with a shadow and its square map: `clip` to each side of its middle, m.
struct LightView {
  Matrix light_from_world;
  float clip;
  int size;
};

// comparable with `before`. light: of both; nothing: no shadows.
Part ChangedPart(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes, const EyeView& eye,
                 const std::optional<LightView>& light);
// The same of the map of shadows.
Part ChangedShadows(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes,
                    const LightView& light);

}  // namespace evalbus::viz
