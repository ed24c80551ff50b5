// Projection of points in the world frame into camera images.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "viz/images/canvas.h"
#include "viz/images/frame.h"

namespace evalbus::viz {

// A camera in MuJoCo's convention. It looks along its -z axis; x points right and y points up.
struct CameraPose {
  double position_m[3];
  double rotation[9];  // world from camera, row-major
  double fovy_deg;
};

// Projects a point with the pinhole model. Returns pixel coordinates from the upper left corner of an image
// of this size; they may be outside the image. Returns nullopt if the point is not in front of the camera.
// Half of the image height corresponds to tan(fovy / 2) at distance 1.
inline std::optional<Point> Project(const CameraPose& camera, FrameSize size, const double point_m[3]) {
  const double d[3] = {point_m[0] - camera.position_m[0], point_m[1] - camera.position_m[1],
                       point_m[2] - camera.position_m[2]};
  double own[3];
  for (int i = 0; i < 3; ++i) {
    own[i] = camera.rotation[i] * d[0] + camera.rotation[3 + i] * d[1] + camera.rotation[6 + i] * d[2];
  }
  constexpr double kNearest = 1e-3;
  if (-own[2] < kNearest) return std::nullopt;
  const double focal = size.height / 2. / std::tan(camera.fovy_deg * std::numbers::pi / 360);
  return Point{size.width / 2. + focal * own[0] / -own[2], size.height / 2. - focal * own[1] / -own[2]};
}

}  // namespace evalbus::viz
