// Finds the regions in which two images of the same camera can differ, because a geom has moved or changed
// its appearance. These regions include its shadows in both images. The result may be too large but is never
// too small. Uses no OpenGL.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <optional>
#include <vector>

#include "viz/images/painter/gl_math.h"

namespace evalbus::viz {

// A rectangle of an image or shadow map, in pixels from the lower left corner. `right` and `top` are
// exclusive.
struct Part {
  int left = 0, bottom = 0, right = 0, top = 0;

  bool is_empty() const { return left >= right || bottom >= top; }
  int width() const { return right - left; }
  int height() const { return top - bottom; }
  bool operator==(const Part&) const = default;
};

// A copy of a scene at the time when it was drawn.
class DrawnScene {
 public:
  explicit DrawnScene(const mjvScene& scene);

  // Returns whether `now` has the same number of geoms, camera, lights and settings, so that only geoms can
  // have changed.
  bool IsComparable(const mjvScene& now) const;
  bool HasAsManyGeoms(const mjvScene& now) const;
  const std::vector<mjvGeom>& geoms() const { return geoms_; }

 private:
  std::vector<mjvGeom> geoms_;
  std::vector<mjvLight> lights_;
  std::array<mjvGLCamera, 2> camera_;
  std::array<mjtByte, mjNRNDFLAG> flags_;
};

// Computes oriented bounding boxes of geoms.
class GeomBoxes {
 public:
  using Corners = std::array<Vec, 8>;

  explicit GeomBoxes(const mjModel& model);

  // Returns the corners of a geom's box in the world frame. Bit i of a corner's index selects the upper end
  // along the geom's axis i. Returns nullopt for a geom without known bounds.
  std::optional<Corners> Of(const mjvGeom& geom) const;

 private:
  // Bounds of each mesh in its own frame.
  std::vector<std::array<Vec, 2>> lowest_and_highest_;
};

// The camera of an image.
struct EyeView {
  Vec place;
  Matrix clip_from_world;
  int width, height;
};

// The light that casts shadows. Its square shadow map extends `clip` meters to each side of the map's center.
struct LightView {
  Matrix light_from_world;
  float clip;
  int size;
};

// Returns the part of the image that may have changed. before.IsComparable(now) must be true. light: the
// light of both scenes that casts shadows; unset if there are no shadows.
Part ChangedPart(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes, const EyeView& eye,
                 const std::optional<LightView>& light);
// Returns the part of the shadow map that may have changed.
Part ChangedShadows(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes,
                    const LightView& light);

}  // namespace evalbus::viz
