#include "collision/closed_forms.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace evalbus::collision {
namespace {

using Eigen::Vector3d;

// Returns the vector from the center of a capsule's or sphere's axis to its end.
Vector3d HalfAxis(const Shape& shape) {
  if (shape.kind == Shape::Kind::kSphere) return Vector3d::Zero();
  return shape.size[1] * shape.rotation.col(2);
}

// Returns a unit vector perpendicular to u, which is always the same for equal u.
Vector3d Perpendicular(const Vector3d& u) {
  return u.squaredNorm() > 0 ? u.unitOrthogonal() : Vector3d(Vector3d::UnitX());
}

// Finds the shortest translation that separates a box around the origin from a segment (center, half vector)
// that intersects it. The Minkowski sum of box and segment is a zonotope, so the translation is along one of
// its facet normals. These are the box axes, and the cross products of a box axis and the segment. Returns
// the depth and, in `normal`, the direction in which the segment must move.
double ShortestWayOut(const Vector3d& half_size, const Vector3d& center, const Vector3d& half,
                      Vector3d* normal) {
  double best = std::numeric_limits<double>::infinity();
  const auto consider = [&](Vector3d axis) {
    const double length = axis.norm();
    if (length < kFlat) return;
    axis /= length;
    const double along = center.dot(axis);
    const double depth = half_size.dot(axis.cwiseAbs()) + std::abs(half.dot(axis)) - std::abs(along);
    if (depth >= best) return;
    best = depth;
    *normal = along < 0 ? Vector3d(-axis) : axis;
  };
  for (int i = 0; i < 3; ++i) consider(Vector3d::Unit(i));
  const double length = half.norm();
  if (length > 0) {
    for (int i = 0; i < 3; ++i) consider(Vector3d::Unit(i).cross(half / length));
  }
  return best;
}

}  // namespace

Proximity PlaneToShape(const Shape& plane, const Shape& other) {
  Proximity result;
  result.normal = plane.rotation.col(2);
  const Vector3d deepest =
      other.position + other.rotation * FarthestPoint(other, other.rotation.transpose() * -result.normal);
  result.distance = (deepest - plane.position).dot(result.normal);
  result.point = deepest - 0.5 * result.distance * result.normal;
  return result;
}

Proximity CapsuleToCapsule(const Shape& a, const Shape& b) {
  // Nearest points of the axes: a.position + s u and b.position + t v with s, t in [-1, 1]. The squared
  // distance is convex, so clamping one parameter, solving for the other and clamping again gives the
  // minimum.
  const Vector3d u = HalfAxis(a);
  const Vector3d v = HalfAxis(b);
  const Vector3d offset = b.position - a.position;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  const auto clamp = [](double x) { return std::clamp(x, -1.0, 1.0); };
  double s = 0;
  double t = 0;
  if (determinant > 1e-14 * uu * vv) {
    s = clamp((offset.dot(u) * vv - offset.dot(v) * uv) / determinant);
    t = clamp((s * u - offset).dot(v) / vv);
    s = clamp((t * v + offset).dot(u) / uu);
  } else if (uu > 0) {
    // The axes are parallel, or b is a point. Use the middle of the range of a that b covers.
    const double center = offset.dot(u) / uu;
    const double reach = std::abs(uv) / uu;
    s = 0.5 * (clamp(center - reach) + clamp(center + reach));
    if (vv > 0) t = clamp((s * u - offset).dot(v) / vv);
  } else if (vv > 0) {
    t = clamp(-offset.dot(v) / vv);
  }
  const Vector3d on_a = a.position + s * u;
  const Vector3d between = offset + t * v - s * u;
  const double gap = between.norm();

  Proximity result;
  result.distance = gap - a.size[0] - b.size[0];
  if (gap > 1e-15) {
    result.normal = between / gap;
  } else {
    const Vector3d across = u.cross(v);
    result.normal =
        across.norm() > kFlat * u.norm() * v.norm() ? across.normalized() : Perpendicular(uu > 0 ? u : v);
  }
  result.point = on_a + (a.size[0] + 0.5 * result.distance) * result.normal;
  return result;
}

Proximity CapsuleToBox(const Shape& capsule, const Shape& box) {
  const double radius = capsule.size[0];
  const Vector3d& h = box.size;
  // In the frame of the box, the axis of the capsule is c + t d, t in [-1, 1].
  const Vector3d c = box.rotation.transpose() * (capsule.position - box.position);
  const Vector3d d = box.rotation.transpose() * HalfAxis(capsule);

  // Half the derivative, with respect to t, of the squared distance between the box and the point c + t d. It
  // never decreases with t, and it is linear between the points where the axis crosses the plane of a face.
  const auto slope = [&](double t) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      const double x = c[i] + t * d[i];
      sum += (x - std::clamp(x, -h[i], h[i])) * d[i];
    }
    return sum;
  };
  std::array<double, 8> knots{-1, 1};
  std::array<double, 8> slopes{slope(-1), slope(1)};
  int count = 2;
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0) continue;
    for (const double face : {-h[i], h[i]}) {
      const double t = (face - c[i]) / d[i];
      if (!(t > -1 && t < 1)) continue;
      knots[count] = t;
      slopes[count++] = slope(t);
    }
  }

  // Returns the parameter at which the slope reaches a level, between the last knot below it and the first
  // knot above.
  const auto crossing = [&](double level) {
    int below = -1;
    int above = -1;
    for (int i = 0; i < count; ++i) {
      if (slopes[i] < level) {
        if (below < 0 || knots[i] > knots[below]) below = i;
      } else {
        if (above < 0 || knots[i] < knots[above]) above = i;
      }
    }
    if (below < 0) return -1.0;
    if (above < 0) return 1.0;
    return knots[below] +
           (knots[above] - knots[below]) * (level - slopes[below]) / (slopes[above] - slopes[below]);
  };
  // The nearest points form an interval, before which the slope is negative and after which it is positive.
  // Use the middle of the interval.
  const double flat = kFlat * d.squaredNorm();
  const double t = d.isZero(0) ? 0 : 0.5 * (crossing(-flat) + crossing(flat));

  const Vector3d on_axis = c + t * d;
  const Vector3d on_box = on_axis.cwiseMax(-h).cwiseMin(h);
  Vector3d normal = on_box - on_axis;  // from the capsule to the box
  const double gap = normal.norm();
  Proximity result;
  if (gap > 1e-12) {
    normal /= gap;
    result.distance = gap - radius;
  } else {
    Vector3d out = Vector3d::UnitX();
    result.distance = -ShortestWayOut(h, c, d, &out) - radius;
    normal = -out;
  }
  // Use the deepest point of the axis. If the axis is perpendicular to the normal, use the nearest or
  // innermost point found above.
  const double across = normal.dot(d);
  const Vector3d deepest = gap > 1e-12 || std::abs(across) < kFlat ? on_axis : Vector3d(c + Side(across) * d);
  const Vector3d point = deepest + (radius + 0.5 * result.distance) * normal;
  result.normal = box.rotation * normal;
  result.point = box.position + box.rotation * point;
  return result;
}

}  // namespace evalbus::collision
