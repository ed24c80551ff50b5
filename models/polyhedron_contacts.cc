#include "models/polyhedron_contacts.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

namespace evalbus {
namespace {

using Vector = std::array<double, 3>;
using Point = std::array<double, 2>;

// These operators are called a thousand times per physics step, and GCC does not inline them without this
// attribute.
[[gnu::always_inline]] inline Vector operator+(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[gnu::always_inline]] inline Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[gnu::always_inline]] inline Vector operator*(double s, const Vector& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
[[gnu::always_inline]] inline double Dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[gnu::always_inline]] inline Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[gnu::always_inline]] inline double Norm(const Vector& a) { return std::sqrt(Dot(a, a)); }

// A box, or the convex hull of a mesh, in the world frame.
class Solid {
 public:
  Solid(const mjModel& model, const mjData& data, int geom)
      : position_(data.geom_xpos + 3 * geom), rotation_(data.geom_xmat + 9 * geom) {
    if (model.geom_type[geom] == mjGEOM_BOX) {
      size_ = model.geom_size + 3 * geom;
      return;
    }
    const int mesh = model.geom_dataid[geom];
    vertices_ = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
    // mjModel.mesh_graph: counts of vertices and faces, then for each vertex of the hull the address of its
    // neighbors and its index in the mesh, then the neighbors, each list ending with -1.
    const int* graph = model.mesh_graph + model.mesh_graphadr[mesh];
    num_vertices_ = graph[0];
    neighbors_at_ = graph + 2;
    index_ = neighbors_at_ + num_vertices_;
    neighbors_ = index_ + num_vertices_;
  }

  Vector center() const { return {position_[0], position_[1], position_[2]}; }

  Vector Vertex(int i) const { return ToWorld(Local(i)); }

  // Returns the index of the vertex that is farthest in a direction.
  int Furthest(const Vector& direction) {
    const Vector local = ToLocal(direction);
    if (size_) return (local[0] >= 0 ? 1 : 0) + (local[1] >= 0 ? 2 : 0) + (local[2] >= 0 ? 4 : 0);
    double most = Dot(local, Local(furthest_));
    for (bool is_climbing = true; is_climbing;) {
      is_climbing = false;
      for (const int* i = neighbors_ + neighbors_at_[furthest_]; *i >= 0; ++i) {
        const double value = Dot(local, Local(*i));
        if (value <= most) continue;
        most = value;
        furthest_ = *i;
        is_climbing = true;
        break;
      }
    }
    return furthest_;
  }
  // Sets the vertex at which the next search begins. If several vertices are equally far, the result depends
  // on it.
  void SearchFrom(int vertex) { furthest_ = vertex < num_vertices_ ? vertex : 0; }

  // Calls visit(i) for each vertex that could be within an angle (rad) of the plane that touches the solid at
  // `corner`, perpendicular to `direction`, and for some others.
  template <class Visit>
  void ForEachNear(const Vector& direction, int corner, double angle, const Visit& visit) const {
    const Vector local = ToLocal(direction), at = Local(corner);
    for (int i = 0; i < num_vertices_; ++i) {
      const Vector to = Local(i) - at;
      const double below = -Dot(local, to) - 2e-9;
      if (below <= 0 || below * below <= 1.1 * angle * angle * Dot(to, to)) visit(i);
    }
  }

 private:
  Vector Local(int i) const {
    if (size_)
      return {i & 1 ? size_[0] : -size_[0], i & 2 ? size_[1] : -size_[1], i & 4 ? size_[2] : -size_[2]};
    const float* vertex = vertices_ + 3 * index_[i];
    return {vertex[0], vertex[1], vertex[2]};
  }
  Vector ToLocal(const Vector& v) const {
    const double* m = rotation_;
    return {m[0] * v[0] + m[3] * v[1] + m[6] * v[2], m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
            m[2] * v[0] + m[5] * v[1] + m[8] * v[2]};
  }
  Vector ToWorld(const Vector& v) const {
    const double* m = rotation_;
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + position_[0],
            m[3] * v[0] + m[4] * v[1] + m[5] * v[2] + position_[1],
            m[6] * v[0] + m[7] * v[1] + m[8] * v[2] + position_[2]};
  }

  const mjtNum *position_, *rotation_;
  const mjtNum* size_ = nullptr;
  const float* vertices_ = nullptr;
  const int *neighbors_at_ = nullptr, *index_ = nullptr, *neighbors_ = nullptr;
  int num_vertices_ = 8;
  int furthest_ = 0;
};

// The smallest movement that separates two solids.
struct Penetration {
  double depth;
  // Unit vector from the first solid to the second.
  Vector normal;
  // The deepest points of both solids.
  Vector on_first, on_second;
};

// A direction in which two geoms (perhaps of another model) were separated.
struct Separation {
  Vector direction{1, 0, 0};
  // The outermost vertices in this direction.
  int on_first = 0, on_second = 0;

  // Returns the distance (m) by which the solids are separated in this direction; negative if they are not.
  double Gap(Solid* first, Solid* second) {
    first->SearchFrom(on_first);
    second->SearchFrom(on_second);
    on_first = first->Furthest(direction);
    on_second = second->Furthest(-1 * direction);
    first->SearchFrom(0);
    second->SearchFrom(0);
    return Dot(second->Vertex(on_second) - first->Vertex(on_first), direction);
  }
};

// If two solids are separated by more than this (m), the expansion below finds no penetration, either, so
// that contacts do not depend on earlier ones. Rounding errors are much smaller.
constexpr double kClear = 1e-6;

// Which pairs of geoms cannot have met yet, because both have moved less than the gap between them since it
// was measured. It is kept in mjData.userdata, so that it belongs to one simulation and is cleared by its
// reset.
class KnownGaps {
 public:
  static int Size(int ngeom) { return ngeom * (kPerGeom + ngeom); }

  KnownGaps(const mjModel& model, const mjData& data, int geom1, int geom2) {
    if (model.nuserdata != Size(model.ngeom)) return;
    travel_ = Travel(model, data, geom1) + Travel(model, data, geom2);
    limit_ = data.userdata + model.ngeom * (kPerGeom + geom1) + geom2;
  }

  bool AreApart() const { return limit_ && travel_ < *limit_; }
  void Set(double gap) {
    if (limit_) *limit_ = travel_ + gap - kClear;
  }

 private:
  // Travel, position and rotation matrix.
  static constexpr int kPerGeom = 13;

  // Returns an upper bound (m) of the path that any point of the geom has moved along since the reset. A turn
  // moves a point by at most the bounding radius times the norm of the difference of the matrices.
  static double Travel(const mjModel& model, const mjData& data, int geom) {
    mjtNum *travel = data.userdata + kPerGeom * geom, *position = travel + 1, *rotation = travel + 4;
    const mjtNum *new_position = data.geom_xpos + 3 * geom, *new_rotation = data.geom_xmat + 9 * geom;
    // Most geoms are part of many pairs, and are at the pose at which the previous pair found them.
    if (std::memcmp(position, new_position, 3 * sizeof(mjtNum)) == 0 &&
        std::memcmp(rotation, new_rotation, 9 * sizeof(mjtNum)) == 0)
      return *travel;
    double moved = 0, turned = 0;
    for (int i = 0; i < 3; ++i) moved += (new_position[i] - position[i]) * (new_position[i] - position[i]);
    for (int i = 0; i < 9; ++i) turned += (new_rotation[i] - rotation[i]) * (new_rotation[i] - rotation[i]);
    *travel += std::sqrt(moved) + model.geom_rbound[geom] * std::sqrt(turned);
    std::copy_n(new_position, 3, position);
    std::copy_n(new_rotation, 9, rotation);
    return *travel;
  }

  double travel_ = 0;
  // Travel of both geoms within which they stay apart; null if the simulation has no memory for gaps.
  mjtNum* limit_ = nullptr;
};

// Expanding polytope algorithm: a polytope inside the Minkowski difference of both solids grows where it is
// nearest to the origin.
class Expansion {
 public:
  // Returns whether the solids penetrate. If not, `separating` is a direction in which they are separated.
  bool Run(Solid* first, Solid* second, Penetration* penetration, Vector* separating) {
    first_ = first;
    second_ = second;
    if (!MakeTetrahedron(separating)) return false;
    for (int i = 0; i < kMaxSteps; ++i) {
      const Face face = *std::ranges::min_element(faces_, {}, &Face::distance);
      const Vertex vertex = Support(face.normal);
      const double support = Dot(vertex.difference, face.normal);
      if (support <= 0) {
        *separating = face.normal;
        return false;
      }
      if (support - face.distance < kTolerance || i == kMaxSteps - 1) {
        *penetration = Measure(face);
        return true;
      }
      Add(vertex);
    }
    return false;
  }

 private:
  static constexpr double kTolerance = 1e-8;
  static constexpr int kMaxSteps = 100;

  struct Vertex {
    Vector on_first, on_second, difference;
  };
  struct Face {
    std::array<int, 3> vertex;
    Vector normal;
    double distance;
  };

  Vertex Support(const Vector& direction) {
    Vertex vertex;
    vertex.on_first = first_->Vertex(first_->Furthest(direction));
    vertex.on_second = second_->Vertex(second_->Furthest(-1 * direction));
    vertex.difference = vertex.on_first - vertex.on_second;
    return vertex;
  }

  // Returns false if a direction has been found in which the solids are separated.
  bool MakeTetrahedron(Vector* separating) {
    const auto separates = [&](const Vector& direction) {
      if (Dot(vertices_.back().difference, direction) > 0) return false;
      *separating = 1 / Norm(direction) * direction;
      return true;
    };
    vertices_.clear();
    faces_.clear();
    Vector direction = second_->center() - first_->center();
    if (Norm(direction) < 1e-12) direction = {1, 0, 0};
    vertices_.push_back(Support(direction));
    if (separates(direction)) return false;
    vertices_.push_back(Support(-1 * direction));
    const Vector line = vertices_[1].difference - vertices_[0].difference;
    // The third point is searched perpendicular to the line, toward the origin if possible.
    Vector side = Dot(line, vertices_[0].difference) / Dot(line, line) * line - vertices_[0].difference;
    if (Norm(side) < 1e-9) {
      const int axis = static_cast<int>(
          std::ranges::min_element(line, {}, [](double x) { return std::abs(x); }) - line.begin());
      Vector unit{};
      unit[static_cast<size_t>(axis)] = 1;
      side = Cross(line, unit);
    }
    vertices_.push_back(Support(side));
    if (separates(side)) return false;
    Vector normal = Cross(line, vertices_[2].difference - vertices_[0].difference);
    if (Norm(normal) < 1e-12) {
      vertices_[2] = Support(-1 * side);
      normal = Cross(line, vertices_[2].difference - vertices_[0].difference);
    }
    if (Dot(normal, vertices_[0].difference) > 0) normal = -1 * normal;
    vertices_.push_back(Support(normal));
    const auto height = [&] {
      return std::abs(Dot(normal, vertices_[3].difference - vertices_[0].difference)) / Norm(normal);
    };
    if (height() < 1e-9) vertices_[3] = Support(-1 * normal);
    if (Dot(Cross(vertices_[1].difference - vertices_[0].difference,
                  vertices_[2].difference - vertices_[0].difference),
            vertices_[3].difference - vertices_[0].difference) > 0) {
      std::swap(vertices_[0], vertices_[1]);
    }
    AddFace(0, 1, 2);
    AddFace(0, 3, 1);
    AddFace(1, 3, 2);
    AddFace(2, 3, 0);
    return true;
  }

  void AddFace(int a, int b, int c) {
    const Vector& origin = vertices_[static_cast<size_t>(a)].difference;
    Vector normal = Cross(vertices_[static_cast<size_t>(b)].difference - origin,
                          vertices_[static_cast<size_t>(c)].difference - origin);
    normal = 1 / std::max(Norm(normal), 1e-300) * normal;
    faces_.push_back({{a, b, c}, normal, Dot(normal, origin)});
  }

  // Replaces the faces that the vertex is in front of by new faces that end at the vertex.
  void Add(const Vertex& vertex) {
    edges_.clear();
    const auto is_seen = [&](const Face& face) {
      return Dot(face.normal, vertex.difference) > face.distance + 1e-12;
    };
    for (size_t i = 0; i < faces_.size();) {
      if (!is_seen(faces_[i])) {
        ++i;
        continue;
      }
      for (size_t k = 0; k < 3; ++k) {
        const std::array<int, 2> edge{faces_[i].vertex[k], faces_[i].vertex[(k + 1) % 3]};
        // An edge between two replaced faces vanishes.
        const auto same = std::ranges::find(edges_, std::array<int, 2>{edge[1], edge[0]});
        if (same == edges_.end()) {
          edges_.push_back(edge);
        } else {
          *same = edges_.back();
          edges_.pop_back();
        }
      }
      faces_[i] = faces_.back();
      faces_.pop_back();
    }
    const int added = static_cast<int>(vertices_.size());
    vertices_.push_back(vertex);
    for (const auto& [a, b] : edges_) AddFace(a, b, added);
  }

  Penetration Measure(const Face& face) const {
    const Vertex& a = vertices_[static_cast<size_t>(face.vertex[0])];
    const Vertex& b = vertices_[static_cast<size_t>(face.vertex[1])];
    const Vertex& c = vertices_[static_cast<size_t>(face.vertex[2])];
    // Coordinates of the origin's projection onto the face.
    const Vector ab = b.difference - a.difference, ac = c.difference - a.difference;
    const Vector to = face.distance * face.normal - a.difference;
    const double uu = Dot(ab, ab), uv = Dot(ab, ac), vv = Dot(ac, ac), u = Dot(ab, to), v = Dot(ac, to);
    const double det = uu * vv - uv * uv;
    const double s = det > 0 ? (vv * u - uv * v) / det : 0, t = det > 0 ? (uu * v - uv * u) / det : 0;
    Penetration result{.depth = face.distance, .normal = face.normal, .on_first = {}, .on_second = {}};
    result.on_first = a.on_first + s * (b.on_first - a.on_first) + t * (c.on_first - a.on_first);
    result.on_second = result.on_first - face.distance * face.normal;
    return result;
  }

  Solid *first_ = nullptr, *second_ = nullptr;
  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
  std::vector<std::array<int, 2>> edges_;
};

// A polygon counts as flat, and two polygons as parallel, up to this angle (rad).
constexpr double kFlat = 1.6e-3;

[[gnu::always_inline]] inline double Turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Two unit vectors that are perpendicular to the normal and to each other.
struct Plane {
  explicit Plane(const Vector& normal) {
    Vector unit{};
    unit[std::abs(normal[0]) < 0.6 ? 0 : 1] = 1;
    x = Cross(normal, unit);
    x = 1 / Norm(x) * x;
    y = Cross(normal, x);
  }
  Point Project(const Vector& v) const { return {Dot(v, x), Dot(v, y)}; }
  Vector x, y;
};

// Returns the face, edge or corner of a solid that is farthest in a direction, as a counterclockwise polygon
// in the plane.
std::vector<Point> Outermost(Solid* solid, const Vector& direction, const Plane& plane) {
  const int furthest = solid->Furthest(direction);
  const Vector corner = solid->Vertex(furthest);
  std::vector<Point> points;
  solid->ForEachNear(direction, furthest, kFlat, [&](int i) {
    const Vector vertex = solid->Vertex(i), to = vertex - corner;
    if (-Dot(to, direction) <= kFlat * Norm(to) + 1e-9) points.push_back(plane.Project(vertex));
  });
  // Convex hull by Andrew's monotone chain.
  std::ranges::sort(points);
  std::vector<Point> hull;
  for (int side = 0; side < 2; ++side) {
    const size_t start = hull.size();
    for (const Point& point : points) {
      while (hull.size() >= start + 2 && Turn(hull[hull.size() - 2], hull.back(), point) <= 1e-14)
        hull.pop_back();
      hull.push_back(point);
    }
    if (points.size() > 1) hull.pop_back();
    std::ranges::reverse(points);
  }
  if (points.size() == 1) hull.resize(1);
  return hull;
}

// Returns the part of a polygon or line that is inside a counterclockwise polygon (Sutherland and Hodgman).
std::vector<Point> Clip(std::vector<Point> points, const std::vector<Point>& polygon) {
  for (size_t i = 0; i < polygon.size() && !points.empty(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    std::vector<Point> kept;
    for (size_t k = 0; k < points.size(); ++k) {
      const Point &p = points[k], &q = points[(k + 1) % points.size()];
      const double at_p = Turn(a, b, p), at_q = Turn(a, b, q);
      if (at_p >= 0) kept.push_back(p);
      if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) {
        const double t = at_p / (at_p - at_q);
        kept.push_back({std::lerp(p[0], q[0], t), std::lerp(p[1], q[1], t)});
      }
    }
    points = std::move(kept);
  }
  return points;
}

// Returns the four corners of a convex polygon that enclose the largest area. For each diagonal from corner i
// to corner k, the other two are the corners on both sides that are farthest from the diagonal. They move
// around the polygon together with k.
std::vector<Point> LargestQuadrilateral(std::vector<Point> polygon) {
  const size_t n = polygon.size();
  if (n <= 4) return polygon;
  // The list contains the corners twice, because the search continues with the first corner after the last.
  polygon.reserve(2 * n);
  polygon.insert(polygon.end(), polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(n));
  double most = -1;
  std::array<size_t, 4> best{};
  for (size_t i = 0; i < n; ++i) {
    size_t j = i + 1, l = i + 3;
    for (size_t k = i + 2; k < n; ++k) {
      const auto area = [&](size_t corner) {
        return std::abs(Turn(polygon[i], polygon[k], polygon[corner]));
      };
      l = std::max(l, k + 1);
      double area_j = area(j), area_l = area(l), next = 0;
      for (; j + 1 < k && (next = area(j + 1)) > area_j; ++j) area_j = next;
      for (; l + 1 < i + n && (next = area(l + 1)) > area_l; ++l) area_l = next;
      if (area_j + area_l > most) {
        most = area_j + area_l;
        best = {i, j, k, l};
      }
    }
  }
  return {polygon[best[0]], polygon[best[1]], polygon[best[2]], polygon[best[3]]};
}

void RemoveRepeated(std::vector<Point>* points) {
  std::vector<Point> kept;
  for (const Point& p : *points) {
    const auto is_near = [&](const Point& q) {
      const double x = p[0] - q[0], y = p[1] - q[1];
      return x * x + y * y < 1e-18;
    };
    if (std::ranges::none_of(kept, is_near)) kept.push_back(p);
  }
  *points = kept;
}

mjfCollision original[mjNGEOMTYPES][mjNGEOMTYPES];

bool IsMarked(const mjModel& model) {
  for (int i = 0; i < model.nnumeric; ++i) {
    if (std::strcmp(model.names + model.name_numericadr[i], kPolyhedronContacts) == 0) return true;
  }
  return false;
}

bool HasHull(const mjModel& model, int geom) {
  return model.geom_type[geom] == mjGEOM_BOX || model.mesh_graphadr[model.geom_dataid[geom]] >= 0;
}

int FindContacts(const mjModel* model, const mjData* data, mjContact* contacts, int geom1, int geom2,
                 mjtNum margin) {
  KnownGaps gaps(*model, *data, geom1, geom2);
  if (gaps.AreApart()) return 0;
  if (margin > 0 || !HasHull(*model, geom1) || !HasHull(*model, geom2) || !IsMarked(*model)) {
    return original[model->geom_type[geom1]][model->geom_type[geom2]](model, data, contacts, geom1, geom2,
                                                                      margin);
  }
  Solid first(*model, *data, geom1), second(*model, *data, geom2);
  // Last known separation of each pair, indexed [geom1 * ngeom + geom2].
  thread_local std::vector<Separation> separations;
  const auto ngeom = static_cast<size_t>(model->ngeom);
  if (separations.size() != ngeom * ngeom) separations.assign(ngeom * ngeom, {});
  Separation& separation = separations[static_cast<size_t>(geom1) * ngeom + static_cast<size_t>(geom2)];
  if (const double gap = separation.Gap(&first, &second); gap > kClear) {
    gaps.Set(gap);
    return 0;
  }
  // This is thread_local so that calls reuse its memory.
  thread_local Expansion expansion;
  Penetration penetration;
  if (!expansion.Run(&first, &second, &penetration, &separation.direction)) return 0;
  const Vector& normal = penetration.normal;
  const Vector middle = 0.5 * (penetration.on_first + penetration.on_second);
  const auto add = [&](mjContact* contact, const Vector& position) {
    contact->dist = -penetration.depth;
    mju_copy3(contact->pos, position.data());
    mju_copy3(contact->frame, normal.data());
    mju_zero3(contact->frame + 3);
  };
  const Plane plane(normal);
  std::vector<Point> a = Outermost(&first, normal, plane), b = Outermost(&second, -1 * normal, plane);
  std::vector<Point> points;
  if (a.size() >= 2 && b.size() >= 2 && a.size() + b.size() >= 5)
    points = a.size() > 2 ? Clip(b, a) : Clip(a, b);
  RemoveRepeated(&points);
  if (points.size() < 2) {
    add(contacts, middle);
    return 1;
  }
  points = LargestQuadrilateral(points);
  const double height = Dot(normal, middle);
  for (size_t i = 0; i < points.size(); ++i) {
    add(contacts + i, points[i][0] * plane.x + points[i][1] * plane.y + height * normal);
  }
  return static_cast<int>(points.size());
}

// Returns true if a point is inside a box (the geom) whose size is multiplied by this factor.
bool IsInside(const mjModel& model, const mjData& data, int geom, const mjtNum* point, double factor) {
  mjtNum offset[3], local[3];
  mju_sub3(offset, point, data.geom_xpos + 3 * geom);
  mju_mulMatTVec(local, data.geom_xmat + 9 * geom, offset, 3, 3);
  for (int i = 0; i < 3; ++i) {
    if (std::abs(local[i]) > factor * model.geom_size[3 * geom + i]) return false;
  }
  return true;
}

// Finds the contacts of two boxes. In marked models without a margin, it removes contacts that MuJoCo 3.3
// would not report: those that are outside one box enlarged by 1 %, and outside the other box shrunk by 1 %.
// This tolerance was found by comparing the contacts of random poses in MuJoCo 2.2.2 and 3.3.3.
int FindBoxContacts(const mjModel* model, const mjData* data, mjContact* contacts, int geom1, int geom2,
                    mjtNum margin) {
  const int number = original[mjGEOM_BOX][mjGEOM_BOX](model, data, contacts, geom1, geom2, margin);
  if (margin > 0 || !IsMarked(*model)) return number;
  constexpr double kTolerance = 0.01;
  const auto is_extra = [&](const mjContact& contact) {
    const auto is_inside = [&](int geom, double factor) {
      return IsInside(*model, *data, geom, contact.pos, factor);
    };
    return (!is_inside(geom1, 1 + kTolerance) && !is_inside(geom2, 1 - kTolerance)) ||
           (!is_inside(geom2, 1 + kTolerance) && !is_inside(geom1, 1 - kTolerance));
  };
  return static_cast<int>(std::remove_if(contacts, contacts + number, is_extra) - contacts);
}

}  // namespace

void ReserveKnownGaps(mjModel* model) {
  if (IsMarked(*model)) model->nuserdata = KnownGaps::Size(model->ngeom);
}

void InstallPolyhedronContacts() {
  original[mjGEOM_BOX][mjGEOM_BOX] = mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_BOX];
  mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_BOX] = FindBoxContacts;
  for (const auto& [a, b] : {std::pair{mjGEOM_BOX, mjGEOM_MESH}, std::pair{mjGEOM_MESH, mjGEOM_MESH}}) {
    original[a][b] = mjCOLLISIONFUNC[a][b];
    mjCOLLISIONFUNC[a][b] = FindContacts;
  }
}

}  // namespace evalbus
