#include "collision/penetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace evalbus::collision {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 1e-6;
constexpr int kMaxSearchSteps = 64;
constexpr int kMaxExpansions = 256;

// A point on the surface of the Minkowski difference a - b, and the two points whose difference it is.
struct Vertex {
  Vector3d w;
  Vector3d on_a;
  Vector3d on_b;
};

// A triangle of vertex indices, counterclockwise seen from outside.
struct Face {
  std::array<int, 3> v;
  Vector3d normal;
  double distance;  // distance of its plane from the origin
};

class Polytope {
 public:
  // Finds four vertices that enclose the origin. Returns false if there are none. The shapes must outlive
  // Expand().
  bool Enclose(const Shape& a, const Shape& b);
  // Expands the polytope until the face nearest to the origin is part of the surface. If rounding ends the
  // search early, returns the smallest depth found.
  std::optional<Proximity> Expand();

 private:
  Vertex Farthest(const Vector3d& direction) const;
  // Returns false for a triangle without area.
  bool AddFace(int i, int j, int k);
  // Replaces the faces visible from the vertex by triangles to it. Returns false if the result is not a
  // closed surface. This happens for slivers and nearly coplanar faces, whose visibility depends on rounding.
  bool Add(const Vertex& vertex);
  // Returns the contact for a face at this depth.
  Proximity DepthAt(const Face& face, double depth) const;

  const Shape* a_ = nullptr;
  const Shape* b_ = nullptr;
  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
  // Edges of the faces that Add() removes.
  std::vector<std::pair<int, int>> edges_;
};

Vertex Polytope::Farthest(const Vector3d& direction) const {
  const Vector3d u = direction.normalized();
  Vertex vertex;
  vertex.on_a = a_->position + a_->rotation * FarthestPoint(*a_, a_->rotation.transpose() * u);
  vertex.on_b = b_->position + b_->rotation * FarthestPoint(*b_, b_->rotation.transpose() * -u);
  vertex.w = vertex.on_a - vertex.on_b;
  return vertex;
}

bool Polytope::AddFace(int i, int j, int k) {
  const Vector3d& w = vertices_[i].w;
  const Vector3d normal = (vertices_[j].w - w).cross(vertices_[k].w - w);
  const double area = normal.norm();
  if (area < 1e-16) return false;
  faces_.push_back({{i, j, k}, normal / area, normal.dot(w) / area});
  return true;
}

bool Polytope::Enclose(const Shape& a, const Shape& b) {
  a_ = &a;
  b_ = &b;
  vertices_.clear();
  faces_.clear();
  // Search two points on opposite sides of the origin, then extend them to a triangle and a tetrahedron
  // toward it.
  Vector3d direction = b.position - a.position;
  if (direction.isZero(0)) direction = Vector3d::UnitX();
  vertices_.push_back(Farthest(direction));
  vertices_.push_back(Farthest(-direction));
  const Vector3d along = vertices_[1].w - vertices_[0].w;
  if (along.squaredNorm() < 1e-20) return false;
  direction = along.cross(-vertices_[0].w).cross(along);
  if (direction.norm() < 1e-12 * along.squaredNorm()) direction = along.unitOrthogonal();
  vertices_.push_back(Farthest(direction));
  direction = along.cross(vertices_[2].w - vertices_[0].w);
  if (direction.squaredNorm() < 1e-24) return false;
  if (direction.dot(vertices_[0].w) > 0) direction = -direction;
  vertices_.push_back(Farthest(direction));

  for (int step = 0; step < kMaxSearchSteps; ++step) {
    // For each face, if the origin is outside, move the opposite vertex to that side.
    bool inside = true;
    for (int opposite = 0; opposite < 4 && inside; ++opposite) {
      const Vector3d& p = vertices_[(opposite + 1) % 4].w;
      Vector3d normal = (vertices_[(opposite + 2) % 4].w - p).cross(vertices_[(opposite + 3) % 4].w - p);
      const double height = normal.dot(vertices_[opposite].w - p);
      if (height == 0) return false;
      if (height > 0) normal = -normal;
      if (normal.dot(p) >= 0) continue;
      inside = false;
      const Vertex next = Farthest(normal);
      if (next.w.dot(normal) <= 0) return false;
      vertices_[opposite] = next;
    }
    if (!inside) continue;
    // For counter-clockwise faces, vertex 3 must lie below the triangle 0 1 2.
    const Vector3d& p = vertices_[0].w;
    if ((vertices_[1].w - p).cross(vertices_[2].w - p).dot(vertices_[3].w - p) > 0) {
      std::swap(vertices_[1], vertices_[2]);
    }
    return AddFace(0, 1, 2) && AddFace(0, 3, 1) && AddFace(1, 3, 2) && AddFace(2, 3, 0);
  }
  return false;
}

bool Polytope::Add(const Vertex& vertex) {
  const int added = static_cast<int>(vertices_.size());
  vertices_.push_back(vertex);
  edges_.clear();
  std::erase_if(faces_, [&](const Face& face) {
    if (face.normal.dot(vertex.w) <= face.distance + 1e-12) return false;
    for (int k = 0; k < 3; ++k) edges_.emplace_back(face.v[k], face.v[(k + 1) % 3]);
    return true;
  });
  for (const auto& [from, to] : edges_) {
    const std::pair<int, int> reverse(to, from);
    const bool is_inner = std::find(edges_.begin(), edges_.end(), reverse) != edges_.end();
    if (!is_inner && !AddFace(from, to, added)) return false;
  }
  // By Euler's formula, a closed surface of triangles has at most this many faces.
  return !faces_.empty() && faces_.size() <= 2 * vertices_.size() - 4;
}

Proximity Polytope::DepthAt(const Face& face, double depth) const {
  // The origin's projection onto the face determines the corresponding points of the two shapes.
  const Vertex& p = vertices_[face.v[0]];
  const Vertex& q = vertices_[face.v[1]];
  const Vertex& r = vertices_[face.v[2]];
  const Vector3d foot = face.distance * face.normal - p.w;
  const Vector3d across = (q.w - p.w).cross(r.w - p.w);
  const double s = foot.cross(r.w - p.w).dot(across) / across.squaredNorm();
  const double t = (q.w - p.w).cross(foot).dot(across) / across.squaredNorm();
  const Vector3d on_a = p.on_a + s * (q.on_a - p.on_a) + t * (r.on_a - p.on_a);
  const Vector3d on_b = p.on_b + s * (q.on_b - p.on_b) + t * (r.on_b - p.on_b);
  return {-depth, 0.5 * (on_a + on_b), face.normal};
}

std::optional<Proximity> Polytope::Expand() {
  // The depth along the normal of any face examined is an upper bound of the penetration depth.
  Face best{};
  double best_depth = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kMaxExpansions; ++step) {
    size_t nearest = 0;
    for (size_t i = 1; i < faces_.size(); ++i) {
      if (faces_[i].distance < faces_[nearest].distance) nearest = i;
    }
    const Face face = faces_[nearest];
    const Vertex next = Farthest(face.normal);
    const double depth = next.w.dot(face.normal);
    const bool is_found = depth - face.distance < kTolerance;
    if (is_found || depth < best_depth) {
      best = face;
      best_depth = depth;
    }
    if (is_found || !Add(next)) break;
  }
  if (best_depth < 0) return std::nullopt;
  return DepthAt(best, best_depth);
}

}  // namespace

std::optional<Proximity> Penetration(const Shape& a, const Shape& b) {
  // The object is static, so that its storage is reused.
  static thread_local Polytope polytope;
  if (!polytope.Enclose(a, b)) return std::nullopt;
  return polytope.Expand();
}

}  // namespace evalbus::collision
