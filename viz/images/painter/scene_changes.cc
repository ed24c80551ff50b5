#include "viz/images/painter/scene_changes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>

namespace evalbus::viz {
namespace {

// Margin around changed regions. It covers rounding errors and the antialiased pixel next to an edge.
constexpr float kMarginPixels = 2;
// Margin around changed shadows, in texels. Shadow lookups interpolate between four texels, and MuJoCo keeps
// one texel at each border empty.
constexpr float kMarginPlaces = 3;
// Below this slope, light is almost parallel to a face, and computing the exact end of a shadow is not
// worthwhile.
constexpr float kGrazing = 0.05f;

struct Range {
  float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity();

  void Include(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool is_empty() const { return low > high; }
};

Range Common(Range a, Range b) { return {std::max(a.low, b.low), std::min(a.high, b.high)}; }

struct Rectangle {
  Range x, y;

  bool is_empty() const { return x.is_empty() || y.is_empty(); }
  bool Contains(const Rectangle& r) const {
    return r.is_empty() || (x.low <= r.x.low && r.x.high <= x.high && y.low <= r.y.low && r.y.high <= y.high);
  }
  void Include(const Rectangle& other) {
    if (other.is_empty()) return;
    for (const float value : {other.x.low, other.x.high}) x.Include(value);
    for (const float value : {other.y.low, other.y.high}) y.Include(value);
  }
};

Rectangle Common(const Rectangle& a, const Rectangle& b) { return {Common(a.x, b.x), Common(a.y, b.y)}; }

constexpr float kEverywhere = 1e9f;
constexpr Rectangle kWhole{{-kEverywhere, kEverywhere}, {-kEverywhere, kEverywhere}};

// Returns the bounding rectangle of points in pixels. It is unbounded if a point is behind the eye.
Rectangle InPixels(const EyeView& eye, std::span<const Vec> points) {
  Rectangle seen;
  const Matrix& m = eye.clip_from_world;
  for (const Vec& p : points) {
    const Vec clip = Place(m, p);
    const float w = m[3] * p.x + m[7] * p.y + m[11] * p.z + m[15];
    if (w < 1e-3f) return kWhole;
    seen.x.Include((clip.x / w + 1) / 2 * static_cast<float>(eye.width));
    seen.y.Include((clip.y / w + 1) / 2 * static_cast<float>(eye.height));
  }
  return seen;
}

// Bounds in the light's frame, m. The light shines along -z.
struct Lit {
  Rectangle at;
  Range z;
};

Lit LitBy(const LightView& light, std::span<const Vec> points) {
  Lit lit;
  for (const Vec& p : points) {
    const Vec q = Place(light.light_from_world, p);
    lit.at.x.Include(q.x);
    lit.at.y.Include(q.y);
    lit.z.Include(q.z);
  }
  return lit;
}

Part Whole(float margin, const Rectangle& r, int width, int height) {
  const auto within = [](float value, int size) {
    return static_cast<int>(std::clamp(value, 0.0f, static_cast<float>(size)));
  };
  if (r.is_empty()) return {};
  return {within(std::floor(r.x.low - margin), width), within(std::floor(r.y.low - margin), height),
          within(std::ceil(r.x.high + margin), width), within(std::ceil(r.y.high + margin), height)};
}

bool IsSame(const mjvGeom& a, const mjvGeom& b) { return !std::memcmp(&a, &b, offsetof(mjvGeom, label)); }

template <class T>
bool AreSame(const T* a, const T* b, size_t count) {
  return count == 0 || !std::memcmp(a, b, count * sizeof(T));
}

// A planar surface patch with its corners in order.
struct Face {
  std::array<Vec, 4> corners;
  Vec normal;
};

// Returns the upper face of a plane, all six faces of a box, or no faces for other shapes.
std::vector<Face> FacesOf(const mjvGeom& geom, const GeomBoxes::Corners& corners) {
  std::vector<Face> faces;
  if (geom.type != mjGEOM_PLANE && geom.type != mjGEOM_BOX) return faces;
  for (size_t axis = 0; axis < 3; ++axis) {
    const size_t i = size_t{1} << axis, u = size_t{1} << (axis + 1) % 3, v = size_t{1} << (axis + 2) % 3;
    for (const bool far : {false, true}) {
      if (geom.type == mjGEOM_PLANE && !(axis == 2 && far)) continue;
      const size_t at = far ? i : 0;
      const float sign = far ? 1.0f : -1.0f;
      const Vec normal = {geom.mat[axis], geom.mat[3 + axis], geom.mat[6 + axis]};
      faces.push_back({{corners[at], corners[at + u], corners[at + u + v], corners[at + v]}, sign * normal});
    }
  }
  return faces;
}

bool CastsShadow(const mjvGeom& geom) { return geom.category != mjCAT_DECOR; }

// An occluder that has not changed: an opaque box.
class Screen {
 public:
  explicit Screen(const mjvGeom& geom) : geom_(&geom) {}

  const mjvGeom* geom() const { return geom_; }
  // Returns whether `place` is inside the box, or so close to it that part of the box may be clipped.
  bool IsAbout(Vec place) const {
    const Vec d = place - Of(geom_->pos);
    for (size_t i = 0; i < 3; ++i) {
      if (std::abs(Dot(Axis(i), d)) > geom_->size[i] + kNear) return false;
    }
    return true;
  }
  // Returns whether the box occludes the convex hull of these points as seen from `place`. It suffices to
  // test the points, because the region that a box occludes is convex.
  bool HidesFromPlace(std::span<const Vec> points, Vec place) const {
    return std::ranges::all_of(points, [&](Vec p) { return IsMet(p, place - p); });
  }
  // Returns whether the box occludes their convex hull from a directional light in the plane through `place`.
  bool HidesFromLight(std::span<const Vec> points, Vec place, Vec direction) const {
    return std::ranges::all_of(points,
                               [&](Vec p) { return IsMet(p, Dot(place - p, direction) * direction); });
  }

 private:
  static constexpr float kNear = 0.1f;
  // The box is shrunk by this length, so that geoms that touch it do not count as hidden.
  static constexpr float kSkin = 0.001f;

  Vec Axis(size_t i) const { return {geom_->mat[i], geom_->mat[3 + i], geom_->mat[6 + i]}; }
  // Returns whether the segment from `point` along `way` intersects the box (slab test).
  bool IsMet(Vec point, Vec way) const {
    const Vec d = point - Of(geom_->pos);
    float first = 0, last = 1;
    for (size_t i = 0; i < 3; ++i) {
      const float at = Dot(Axis(i), d), step = Dot(Axis(i), way), half = geom_->size[i] - kSkin;
      if (std::abs(step) < 1e-9f) {
        if (std::abs(at) > half) return false;
        continue;
      }
      const float ahead = std::copysign(half, step);
      first = std::max(first, (-ahead - at) / step);
      last = std::min(last, (ahead - at) / step);
    }
    return first < last;
  }

  const mjvGeom* geom_;
};

// Finds where changed shadows fall. The shadow map is divided into a grid of square columns along the light
// direction.
class Shadows {
 public:
  Shadows(const LightView& light, const EyeView& eye)
      : light_(light),
        eye_(eye),
        image_{{0, static_cast<float>(eye.width)}, {0, static_cast<float>(eye.height)}},
        world_from_light_(Inverse(light.light_from_world)),
        direction_(Turn(world_from_light_, {0, 0, -1})),
        lamp_(Place(world_from_light_, {0, 0, 0})),
        margin_(kMarginPlaces * 2 * light.clip / static_cast<float>(light.size)) {
    nearest_.fill(-std::numeric_limits<float>::infinity());
  }

  // Adds a geom whose shadow has changed or has disappeared.
  void AddChanged(const GeomBoxes::Corners& corners) {
    const Lit lit = LitBy(light_, corners);
    const auto [left, right] = Columns(lit.at.x);
    const auto [bottom, top] = Columns(lit.at.y);
    for (size_t y = bottom; y < top; ++y) {
      for (size_t x = left; x < right; ++x) {
        float& nearest = nearest_[y * kColumns + x];
        nearest = std::max(nearest, lit.z.high);
      }
    }
  }
  // Adds a geom that has not changed.
  void AddUnchanged(const mjvGeom& geom, const GeomBoxes::Corners& corners) {
    if (geom.type == mjGEOM_BOX && geom.rgba[3] >= 0.995f && CastsShadow(geom)) {
      const Screen screen(geom);
      if (!screen.IsAbout(eye_.place) && !screen.IsAbout(lamp_)) screens_.push_back(screen);
    }
    const std::vector<Face> faces = FacesOf(geom, corners);
    if (faces.empty()) receivers_.push_back({&geom, LitBy(light_, corners), InPixels(eye_, corners), {}, 0});
    for (const Face& face : faces) {
      const float slope = Dot(face.normal, direction_);
      if (slope >= 0) continue;
      receivers_.push_back({&geom, LitBy(light_, face.corners), InPixels(eye_, face.corners), face, slope});
    }
  }
  // Extends `seen` by the pixels in which changed shadows are visible.
  void AddTo(Rectangle* seen) const {
    for (size_t i = 0; i < nearest_.size(); ++i) {
      if (std::isinf(nearest_[i])) continue;
      const Rectangle column = {ColumnRange(i % kColumns), ColumnRange(i / kColumns)};
      for (const Receiver& receiver : receivers_) {
        const Rectangle at = Common(receiver.lit.at, column);
        if (at.is_empty() || receiver.lit.z.low > nearest_[i]) continue;
        Points room;
        const auto points =
            receiver.slope < 0 ? OnFace(receiver, column, &room) : InBox(receiver, at, nearest_[i], &room);
        const Rectangle fallen = Common(Common(receiver.seen, InPixels(eye_, points)), image_);
        if (!seen->Contains(fallen) && !IsHidden(receiver, points)) seen->Include(fallen);
      }
    }
  }

 private:
  static constexpr size_t kColumns = 32;
  using Points = std::array<Vec, 8>;

  // A lit face, or a whole geom if it has no planar faces.
  struct Receiver {
    const mjvGeom* geom;
    Lit lit;
    Rectangle seen;
    Face face;
    // Dot product of light direction and face normal. -1: perpendicular incidence. 0: a geom without faces.
    float slope;
  };

  float ColumnWidth() const { return 2 * light_.clip / kColumns; }
  std::pair<size_t, size_t> Columns(Range at) const {
    const auto column = [&](float meters) {
      return static_cast<size_t>(std::clamp((meters + light_.clip) / ColumnWidth(), 0.0f, float{kColumns}));
    };
    return {column(at.low - margin_), std::min(column(at.high + margin_) + 1, kColumns)};
  }
  Range ColumnRange(size_t i) const {
    const float low = -light_.clip + static_cast<float>(i) * ColumnWidth();
    return {low - margin_, low + ColumnWidth() + margin_};
  }
  // Returns the corners of the face's intersection with the column; `room` provides the storage.
  std::span<const Vec> OnFace(const Receiver& receiver, const Rectangle& column, Points* room) const {
    const Face& face = receiver.face;
    if (receiver.slope > -kGrazing) return face.corners;
    for (size_t i = 0; i < 4; ++i) {
      const Vec from = Place(world_from_light_,
                             {i & 1 ? column.x.high : column.x.low, i & 2 ? column.y.high : column.y.low, 0});
      (*room)[i] = from + (Dot(face.normal, face.corners[0] - from) / receiver.slope) * direction_;
    }
    return {room->data(), 4};
  }
  std::span<const Vec> InBox(const Receiver& receiver, const Rectangle& at, float nearest,
                             Points* room) const {
    const Range z = {receiver.lit.z.low, std::min(receiver.lit.z.high, nearest)};
    for (size_t i = 0; i < 8; ++i) {
      (*room)[i] = Place(world_from_light_, {i & 1 ? at.x.high : at.x.low, i & 2 ? at.y.high : at.y.low,
                                             i & 4 ? z.high : z.low});
    }
    return *room;
  }
  // Returns whether an unchanged box hides these points from the light or from the eye.
  bool IsHidden(const Receiver& receiver, std::span<const Vec> points) const {
    return std::ranges::any_of(screens_, [&](const Screen& screen) {
      return screen.geom() != receiver.geom &&
             (screen.HidesFromPlace(points, eye_.place) || screen.HidesFromLight(points, lamp_, direction_));
    });
  }

  const LightView& light_;
  const EyeView& eye_;
  const Rectangle image_;
  const Matrix world_from_light_;
  const Vec direction_, lamp_;
  const float margin_;
  // Maximum z (light frame) of the changed shadow casters, per column.
  std::array<float, kColumns * kColumns> nearest_;
  std::vector<Receiver> receivers_;
  std::vector<Screen> screens_;
};

}  // namespace

DrawnScene::DrawnScene(const mjvScene& scene)
    : geoms_(scene.geoms, scene.geoms + scene.ngeom), lights_(scene.lights, scene.lights + scene.nlight) {
  std::copy_n(scene.camera, 2, camera_.begin());
  std::copy_n(scene.flags, mjNRNDFLAG, flags_.begin());
}

bool DrawnScene::HasAsManyGeoms(const mjvScene& now) const {
  return geoms_.size() == static_cast<size_t>(now.ngeom);
}

bool DrawnScene::IsComparable(const mjvScene& now) const {
  return HasAsManyGeoms(now) && lights_.size() == static_cast<size_t>(now.nlight) &&
         AreSame(lights_.data(), now.lights, lights_.size()) && AreSame(camera_.data(), now.camera, 2) &&
         AreSame(flags_.data(), now.flags, flags_.size());
}

GeomBoxes::GeomBoxes(const mjModel& model) {
  for (int mesh = 0; mesh < model.nmesh; ++mesh) {
    Range range[3];
    for (int i = 0; i < model.mesh_vertnum[mesh]; ++i) {
      const float* const vertex = model.mesh_vert + 3 * (model.mesh_vertadr[mesh] + i);
      for (int axis = 0; axis < 3; ++axis) range[axis].Include(vertex[axis]);
    }
    lowest_and_highest_.push_back(
        {Vec{range[0].low, range[1].low, range[2].low}, Vec{range[0].high, range[1].high, range[2].high}});
  }
}

std::optional<GeomBoxes::Corners> GeomBoxes::Of(const mjvGeom& geom) const {
  Vec high = viz::Of(geom.size);
  Vec low = -1 * high;
  switch (geom.type) {
    case mjGEOM_PLANE:
      low.z = high.z = 0;
      break;
    case mjGEOM_CAPSULE:
      high.z += std::max(high.x, high.y);
      low.z = -high.z;
      break;
    case mjGEOM_SPHERE:
    case mjGEOM_ELLIPSOID:
    case mjGEOM_CYLINDER:
    case mjGEOM_BOX:
      break;
    case mjGEOM_MESH: {
      // An even dataid stands for a mesh, an odd dataid for its convex hull.
      const auto mesh = static_cast<size_t>(geom.dataid / 2);
      if (geom.dataid < 0 || mesh >= lowest_and_highest_.size()) return std::nullopt;
      low = lowest_and_highest_[mesh][0];
      high = lowest_and_highest_[mesh][1];
      break;
    }
    default:
      if (geom.modelrbound <= 0) return std::nullopt;
      high = {geom.modelrbound, geom.modelrbound, geom.modelrbound};
      low = -1 * high;
  }
  Corners corners;
  const float* const r = geom.mat;
  for (size_t i = 0; i < 8; ++i) {
    const Vec p = {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    corners[i] =
        viz::Of(geom.pos) + Vec{r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
                                r[6] * p.x + r[7] * p.y + r[8] * p.z};
  }
  return corners;
}

Part ChangedPart(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes, const EyeView& eye,
                 const std::optional<LightView>& light) {
  const Part whole{0, 0, eye.width, eye.height};
  Rectangle changed;
  std::optional<Shadows> shadows;
  if (light) shadows.emplace(*light, eye);
  for (size_t i = 0; i < before.geoms().size(); ++i) {
    const mjvGeom& was = before.geoms()[i];
    const mjvGeom& is = now.geoms[i];
    const auto there = boxes.Of(was), here = boxes.Of(is);
    if (!there || !here) return whole;
    if (IsSame(was, is)) {
      if (shadows) shadows->AddUnchanged(is, *here);
      continue;
    }
    for (const auto& corners : {*there, *here}) {
      changed.Include(InPixels(eye, corners));
      if (shadows && CastsShadow(is)) shadows->AddChanged(corners);
    }
  }
  if (shadows) shadows->AddTo(&changed);
  return Whole(kMarginPixels, changed, eye.width, eye.height);
}

Part ChangedShadows(const DrawnScene& before, const mjvScene& now, const GeomBoxes& boxes,
                    const LightView& light) {
  Rectangle changed;
  for (size_t i = 0; i < before.geoms().size(); ++i) {
    const mjvGeom& was = before.geoms()[i];
    const mjvGeom& is = now.geoms[i];
    if (!CastsShadow(is) || IsSame(was, is)) continue;
    const auto there = boxes.Of(was), here = boxes.Of(is);
    if (!there || !here) return {0, 0, light.size, light.size};
    changed.Include(LitBy(light, *there).at);
    changed.Include(LitBy(light, *here).at);
  }
  const auto place = [&](float meters) {
    return 1 + (meters / light.clip + 1) / 2 * static_cast<float>(light.size - 2);
  };
  const Rectangle places = {{place(changed.x.low), place(changed.x.high)},
                            {place(changed.y.low), place(changed.y.high)}};
  return Whole(kMarginPlaces, places, light.size, light.size);
}

}  // namespace evalbus::viz
