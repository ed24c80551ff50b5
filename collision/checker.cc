#include "collision/checker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include "base/errors.h"
#include "collision/closed_forms.h"
#include "collision/nearest_pair.h"
#include "collision/pair_filter.h"
#include "collision/penetration.h"

// In the libraries, only this file includes FCL's headers, which take long to compile.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace evalbus::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// FCL reports only strict overlap. Its shapes are enlarged by half the contact distance on every side, so
// that the enlarged shapes overlap if the true shapes are in contact (approximately for meshes).
constexpr double kGrowth = 0.5 * contact_t::TOUCH_DISTANCE_M;

// A geom in FCL's broad phase, with a bounding box computed here. For rotated geoms, FCL's own box encloses
// the bounding sphere and is larger.
class BroadPhaseObject : public fcl::CollisionObjectd {
 public:
  BroadPhaseObject(const std::shared_ptr<fcl::CollisionGeometryd>& shape, int index_in)
      : fcl::CollisionObjectd(shape), index(index_in) {}
  void SetBounds(const Vector3d& lower, const Vector3d& upper) { aabb = fcl::AABBd(lower, upper); }
  // Index of the geom in Impl::geoms.
  const int index;
};

struct Geom {
  int id = -1;
  int body = -1;
  Shape shape;
  double radius = 0;
  // True if the geom can be on the robot's side, or on the scene's side, of a clearance.
  bool is_moving_robot = false;
  bool is_scene = false;
  // Pose in the body frame.
  Vector3d local_position;
  Matrix3d local_rotation;
  // Bounding box in the world frame. For a mesh, also its center and half extents in the geom frame.
  Vector3d lower;
  Vector3d upper;
  Vector3d mesh_center;
  Vector3d mesh_half;
  std::shared_ptr<fcl::CollisionGeometryd> fcl_shape;
  fcl::Transform3d fcl_pose;
};

enum class Method { kPlaneShape, kCapsuleCapsule, kCapsuleBox, kFcl };

struct Pair {
  int a;
  int b;
  Method method;
  // True if the closed form expects the geoms in the order (b, a).
  bool swapped;
};

Shape::Kind KindOf(int mujoco_type, const std::string& who) {
  switch (mujoco_type) {
    case mjGEOM_PLANE:
      return Shape::Kind::kPlane;
    case mjGEOM_SPHERE:
      return Shape::Kind::kSphere;
    case mjGEOM_CAPSULE:
      return Shape::Kind::kCapsule;
    case mjGEOM_ELLIPSOID:
      return Shape::Kind::kEllipsoid;
    case mjGEOM_CYLINDER:
      return Shape::Kind::kCylinder;
    case mjGEOM_BOX:
      return Shape::Kind::kBox;
    case mjGEOM_MESH:
      return Shape::Kind::kMesh;
    default:
      throw InputError(
          who + " has a shape that collision checking does not support; use a plane, sphere, capsule, " +
          "ellipsoid, cylinder, box or mesh");
  }
}

// Returns a mesh's convex hull, read from the graph of the compiled model: numvert, numface,
// vert_edgeadr[numvert], vert_globalid[numvert], edge_localid[numvert + 3 numface], face_globalid[3 numface].
std::shared_ptr<fcl::Convexd> MakeHull(const mjModel& m, int mesh, const std::string& who) {
  if (m.mesh_graphadr[mesh] < 0)
    throw InputError(who + " is a mesh without a convex hull in the compiled model");
  const int* graph = m.mesh_graph + m.mesh_graphadr[mesh];
  const int num_corners = graph[0];
  const int num_faces = graph[1];
  const int* global_id = graph + 2 + num_corners;
  const int* face_global_id = global_id + num_corners + num_corners + 3 * num_faces;
  const float* vertex = m.mesh_vert + 3 * m.mesh_vertadr[mesh];

  auto corners = std::make_shared<std::vector<Vector3d>>();
  std::vector<int> local_id(m.mesh_vertnum[mesh], -1);
  for (int i = 0; i < num_corners; ++i) {
    const float* v = vertex + 3 * global_id[i];
    corners->emplace_back(v[0], v[1], v[2]);
    local_id[global_id[i]] = i;
  }
  auto faces = std::make_shared<std::vector<int>>();
  for (int i = 0; i < num_faces; ++i) {
    faces->push_back(3);
    for (int k = 0; k < 3; ++k) faces->push_back(local_id[face_global_id[3 * i + k]]);
  }
  return std::make_shared<fcl::Convexd>(corners, num_faces, faces);
}

Pair MakePair(int a, int b, const Shape& shape_a, const Shape& shape_b) {
  if (shape_a.kind == Shape::Kind::kPlane) return {a, b, Method::kPlaneShape, false};
  if (shape_b.kind == Shape::Kind::kPlane) return {a, b, Method::kPlaneShape, true};
  if (IsRound(shape_a) && IsRound(shape_b)) return {a, b, Method::kCapsuleCapsule, false};
  if (IsRound(shape_a) && shape_b.kind == Shape::Kind::kBox) return {a, b, Method::kCapsuleBox, false};
  if (IsRound(shape_b) && shape_a.kind == Shape::Kind::kBox) return {a, b, Method::kCapsuleBox, true};
  return {a, b, Method::kFcl, false};
}

}  // namespace

struct CollisionChecker::Impl {
  // Geoms that occur in a pair, in the order of geom ids. a and b of a pair are indices into this list.
  std::vector<Geom> geoms;
  // Index into `geoms` of each geom id; -1 if the geom is in no pair.
  std::vector<int> geom_of;
  // Geoms of body i: geoms[first_geom[i]] up to geoms[first_geom[i + 1]]; geom ids are grouped by body.
  std::vector<int> first_geom;
  // Pose of each body as passed to SetBodyPose(): position, then quaternion; NaN before the first call.
  std::vector<std::array<double, 7>> body_pose;
  std::vector<Pair> pairs;
  // Index into pairs for two geoms (a * geoms.size() + b, a < b); -1 if the pair is not checked.
  std::vector<int> pair_of;
  // Broad phase of all geoms except planes, whose infinite boxes FCL does not support. Pairs with a plane are
  // always candidates. Candidates are evaluated in the order of `pairs`, independent of the order in which
  // the broad phase finds them.
  fcl::DynamicAABBTreeCollisionManagerd broad_phase;
  std::vector<std::unique_ptr<BroadPhaseObject>> objects;
  std::vector<int> plane_pairs;
  std::vector<int> candidates;
  bool is_set_up = false;
  // Pairs that count for the clearance (a is the robot's geom), and the search for the nearest of these
  // pairs.
  std::vector<Pair> clearance_pairs;
  std::optional<NearestPair> nearest;
  std::vector<contact_t> contacts;
  fcl::CollisionRequestd overlap_request;
  fcl::CollisionRequestd contact_request;
  fcl::DistanceRequestd distance_request;
  fcl::CollisionResultd contact_result;
  fcl::DistanceResultd distance_result;

  Geom MakeGeom(const mjModel& m, int id) const;
  void UpdateBounds(Geom* geom) const;
  void Place(int index, const Vector3d& position, const Matrix3d& rotation);
  // Fills `candidates` with the pairs whose bounding boxes overlap.
  void FindCandidates();
  // Computes the nearest points of the two shapes of a pair.
  void FindPoints(const Pair& pair, Vector3d* on_a, Vector3d* on_b);
  // Computes the contact of a pair; returns false if there is none. With `true_distance`, also computes the
  // distance of separated shapes; their normal and point are valid only for closed forms.
  bool Evaluate(const Pair& pair, bool true_distance, Proximity* result);
};

Geom CollisionChecker::Impl::MakeGeom(const mjModel& m, int id) const {
  const char* name = m.names + m.name_geomadr[id];
  const std::string who = "geom " + std::to_string(id) + " \"" + name + "\"";
  Geom geom;
  geom.id = id;
  geom.body = m.geom_bodyid[id];
  geom.local_position = Eigen::Map<const Vector3d>(m.geom_pos + 3 * id);
  const double* q = m.geom_quat + 4 * id;
  geom.local_rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  Shape& shape = geom.shape;
  shape.kind = KindOf(m.geom_type[id], who);
  shape.size = Eigen::Map<const Vector3d>(m.geom_size + 3 * id);
  const Vector3d grown = shape.size.array() + kGrowth;
  switch (shape.kind) {
    case Shape::Kind::kPlane:
      break;
    case Shape::Kind::kSphere:
      geom.fcl_shape = std::make_shared<fcl::Sphered>(grown[0]);
      break;
    case Shape::Kind::kCapsule:
      geom.fcl_shape = std::make_shared<fcl::Capsuled>(grown[0], 2 * shape.size[1]);
      break;
    case Shape::Kind::kEllipsoid:
      geom.fcl_shape = std::make_shared<fcl::Ellipsoidd>(grown);
      break;
    case Shape::Kind::kCylinder:
      geom.fcl_shape = std::make_shared<fcl::Cylinderd>(grown[0], 2 * grown[1]);
      break;
    case Shape::Kind::kBox:
      geom.fcl_shape = std::make_shared<fcl::Boxd>(2 * grown);
      break;
    case Shape::Kind::kMesh: {
      const auto hull = MakeHull(m, m.geom_dataid[id], who);
      const std::vector<Vector3d>& corners = hull->getVertices();
      shape.corners.resize(static_cast<Eigen::Index>(corners.size()), 3);
      for (size_t i = 0; i < corners.size(); ++i)
        shape.corners.row(static_cast<Eigen::Index>(i)) = corners[i].transpose();
      const Vector3d lower = shape.corners.colwise().minCoeff(), upper = shape.corners.colwise().maxCoeff();
      geom.mesh_center = 0.5 * (lower + upper);
      geom.mesh_half = 0.5 * (upper - lower);
      geom.fcl_shape = hull;
      break;
    }
  }
  geom.radius = Radius(shape);
  return geom;
}

void CollisionChecker::Impl::UpdateBounds(Geom* geom) const {
  const Shape& shape = geom->shape;
  const Vector3d& s = shape.size;
  const Matrix3d& r = shape.rotation;
  Vector3d center = shape.position;
  Vector3d half = Vector3d::Zero();
  switch (shape.kind) {
    case Shape::Kind::kPlane:
      half.setConstant(kInfinity);
      break;
    case Shape::Kind::kSphere:
      half.setConstant(s[0]);
      break;
    case Shape::Kind::kCapsule:
      half = s[1] * r.col(2).cwiseAbs() + Vector3d::Constant(s[0]);
      break;
    case Shape::Kind::kEllipsoid:
      half = (r * s.asDiagonal()).rowwise().norm();
      break;
    case Shape::Kind::kCylinder:
      half = s[1] * r.col(2).cwiseAbs() + s[0] * r.leftCols<2>().rowwise().norm();
      break;
    case Shape::Kind::kBox:
      half = r.cwiseAbs() * s;
      break;
    case Shape::Kind::kMesh:
      center += r * geom->mesh_center;
      half = r.cwiseAbs() * geom->mesh_half;
      break;
  }
  half.array() += contact_t::TOUCH_DISTANCE_M;
  geom->lower = center - half;
  geom->upper = center + half;
}

void CollisionChecker::Impl::Place(int index, const Vector3d& position, const Matrix3d& rotation) {
  Geom& geom = geoms[index];
  if (geom.shape.kind == Shape::Kind::kPlane) {
    nearest->Forget();
  } else {
    // The operator norm of a difference of rotations is at most its Frobenius norm / sqrt(2).
    nearest->Moved(index, (position - geom.shape.position).norm() +
                              geom.radius * (rotation - geom.shape.rotation).norm() / std::numbers::sqrt2);
  }
  geom.shape.position = position;
  geom.shape.rotation = rotation;
  geom.fcl_pose.linear() = rotation;
  geom.fcl_pose.translation() = position;
  UpdateBounds(&geom);
  if (objects[index]) objects[index]->SetBounds(geom.lower, geom.upper);
}

void CollisionChecker::Impl::FindCandidates() {
  if (is_set_up) {
    broad_phase.update();
  } else {
    for (const auto& object : objects) {
      if (object) broad_phase.registerObject(object.get());
    }
    broad_phase.setup();
    is_set_up = true;
  }
  candidates = plane_pairs;
  broad_phase.collide(this, [](fcl::CollisionObjectd* first, fcl::CollisionObjectd* second, void* data) {
    auto* self = static_cast<Impl*>(data);
    const auto [a, b] = std::minmax(static_cast<BroadPhaseObject*>(first)->index,
                                    static_cast<BroadPhaseObject*>(second)->index);
    const int pair = self->pair_of[static_cast<size_t>(a) * self->geoms.size() + static_cast<size_t>(b)];
    if (pair >= 0) self->candidates.push_back(pair);
    return false;  // continue
  });
  std::sort(candidates.begin(), candidates.end());
}

bool CollisionChecker::Impl::Evaluate(const Pair& pair, bool true_distance, Proximity* result) {
  const Geom& first = geoms[pair.swapped ? pair.b : pair.a];
  const Geom& second = geoms[pair.swapped ? pair.a : pair.b];
  if (pair.method == Method::kFcl) {
    contact_result.clear();
    if (fcl::collide(first.fcl_shape.get(), first.fcl_pose, second.fcl_shape.get(), second.fcl_pose,
                     overlap_request, contact_result) > 0) {
      if (const std::optional<Proximity> deep = Penetration(first.shape, second.shape)) {
        *result = *deep;
        return true;
      }
      // Only the enlarged shapes overlap, or the true shapes overlap by a negligible depth, so FCL's rough
      // estimate is sufficient.
      contact_result.clear();
      fcl::collide(first.fcl_shape.get(), first.fcl_pose, second.fcl_shape.get(), second.fcl_pose,
                   contact_request, contact_result);
      if (contact_result.numContacts() > 0 && contact_result.getContact(0).normal.squaredNorm() > 0.5) {
        const fcl::Contactd& contact = contact_result.getContact(0);
        result->distance = 2 * kGrowth - contact.penetration_depth;
        result->point = contact.pos;
        result->normal = contact.normal;
        return true;
      }
      // The enlarged shapes only touch. FCL then gives a zero normal or, because its two algorithms differ in
      // the last bit, no contact.
      const Eigen::Vector3d a = first.fcl_pose.translation(), b = second.fcl_pose.translation();
      result->distance = 2 * kGrowth;
      result->point = (a + b) / 2;
      result->normal = a == b ? Eigen::Vector3d::UnitZ() : (b - a).normalized();
      return true;
    }
    if (!true_distance) return false;
    distance_result.clear();
    fcl::distance(first.fcl_shape.get(), first.fcl_pose, second.fcl_shape.get(), second.fcl_pose,
                  distance_request, distance_result);
    // The shapes are not in contact, so FCL's negative value for overlapping shapes can only mean that they
    // almost touch.
    result->distance = 2 * kGrowth + std::max(0.0, distance_result.min_distance);
    return true;
  }
  switch (pair.method) {
    case Method::kPlaneShape:
      *result = PlaneToShape(first.shape, second.shape);
      break;
    case Method::kCapsuleCapsule:
      *result = CapsuleToCapsule(first.shape, second.shape);
      break;
    default:
      *result = CapsuleToBox(first.shape, second.shape);
      break;
  }
  if (pair.swapped) result->normal = -result->normal;
  return true_distance || result->distance <= contact_t::TOUCH_DISTANCE_M;
}

void CollisionChecker::Impl::FindPoints(const Pair& pair, Vector3d* on_a, Vector3d* on_b) {
  Proximity proximity;
  Evaluate(pair, true, &proximity);
  if (proximity.distance <= contact_t::TOUCH_DISTANCE_M) {
    *on_a = *on_b = proximity.point;
  } else if (pair.method == Method::kFcl) {
    // FCL returns the nearest points of the enlarged shapes, which are moved back to the true surfaces.
    const Vector3d first = distance_result.nearest_points[0], second = distance_result.nearest_points[1];
    const Vector3d growth = kGrowth * (second - first).normalized();
    *on_a = first - growth;
    *on_b = second + growth;
    if (pair.swapped) std::swap(*on_a, *on_b);
  } else {
    // The point is midway between the surfaces.
    *on_a = proximity.point - 0.5 * proximity.distance * proximity.normal;
    *on_b = proximity.point + 0.5 * proximity.distance * proximity.normal;
  }
}

CollisionChecker::CollisionChecker(const mjModel* model, const model_info_t& info) : impl_(new Impl) {
  const mjModel& m = *model;
  if (info.num_geoms != m.ngeom || info.num_bodies != m.nbody) {
    throw InputError("MODEL describes " + std::to_string(info.num_bodies) + " bodies and " +
                     std::to_string(info.num_geoms) + " geoms, the model file has " +
                     std::to_string(m.nbody) + " and " + std::to_string(m.ngeom));
  }
  for (const int entity : info.body_entity) {
    if (entity < 0 || entity >= info.num_entities) throw InputError("MODEL: body_entity out of range");
  }
  for (const gripper_info_t& gripper : info.gripper) {
    for (const int pad : gripper.pad_geom) {
      if (pad < 0 || pad >= m.ngeom) throw InputError("MODEL: gripper pad_geom out of range");
    }
  }

  const std::vector<std::pair<int, int>> checked = CheckedPairs(m, info);
  const auto kind_of = [&](const Geom& geom) -> int8_t {
    const bool is_forbidden =
        std::ranges::find(info.forbidden_contact_geom, geom.id) != info.forbidden_contact_geom.end();
    return is_forbidden ? model_info_t::FIXTURE : info.entity_kind[info.body_entity[geom.body]];
  };
  std::vector<int>& index = impl_->geom_of;
  index.assign(m.ngeom, -1);
  for (const auto& [a, b] : checked) index[a] = index[b] = 0;
  impl_->first_geom.assign(m.nbody + 1, 0);
  for (int id = 0; id < m.ngeom; ++id) {
    if (index[id] < 0) continue;
    index[id] = static_cast<int>(impl_->geoms.size());
    Geom& geom = impl_->geoms.emplace_back(impl_->MakeGeom(m, id));
    geom.is_moving_robot = kind_of(geom) == model_info_t::ROBOT && m.body_weldid[geom.body] != 0;
    geom.is_scene = kind_of(geom) == model_info_t::WORLD || kind_of(geom) == model_info_t::FIXTURE;
    ++impl_->first_geom[m.geom_bodyid[id] + 1];
  }
  for (int body = 0; body < m.nbody; ++body) impl_->first_geom[body + 1] += impl_->first_geom[body];
  impl_->body_pose.resize(m.nbody);
  for (auto& pose : impl_->body_pose) pose.fill(std::numeric_limits<double>::quiet_NaN());
  impl_->pair_of.assign(impl_->geoms.size() * impl_->geoms.size(), -1);
  for (size_t i = 0; i < impl_->geoms.size(); ++i) {
    const Geom& geom = impl_->geoms[i];
    impl_->objects.push_back(geom.shape.kind == Shape::Kind::kPlane
                                 ? nullptr
                                 : std::make_unique<BroadPhaseObject>(geom.fcl_shape, static_cast<int>(i)));
  }
  for (const auto& [a, b] : checked) {
    const Geom& geom_a = impl_->geoms[index[a]];
    const Geom& geom_b = impl_->geoms[index[b]];
    const Pair pair = MakePair(index[a], index[b], geom_a.shape, geom_b.shape);
    impl_->pair_of[index[a] * impl_->geoms.size() + index[b]] = static_cast<int>(impl_->pairs.size());
    if (pair.method == Method::kPlaneShape)
      impl_->plane_pairs.push_back(static_cast<int>(impl_->pairs.size()));
    impl_->pairs.push_back(pair);
    if (geom_a.is_moving_robot && geom_b.is_scene) impl_->clearance_pairs.push_back(pair);
    if (geom_b.is_moving_robot && geom_a.is_scene) {
      impl_->clearance_pairs.push_back({pair.b, pair.a, pair.method, !pair.swapped});
    }
  }
  std::vector<std::pair<int, int>> clearance_pairs;
  for (const Pair& pair : impl_->clearance_pairs) clearance_pairs.emplace_back(pair.a, pair.b);
  impl_->nearest.emplace(std::move(clearance_pairs), static_cast<int>(impl_->geoms.size()));
  impl_->contacts.reserve(64);
  impl_->contact_request.enable_contact = true;
  impl_->contact_request.num_max_contacts = 1;  // the deepest
  impl_->contact_request.gjk_solver_type = fcl::GST_LIBCCD;
  impl_->distance_request.gjk_solver_type = fcl::GST_LIBCCD;
  impl_->distance_request.distance_tolerance = 1e-9;
}

CollisionChecker::~CollisionChecker() = default;

bool IsPose(const double position[3], const double quat_wxyz[4]) {
  const Eigen::Map<const Eigen::Vector4d> quat(quat_wxyz);
  return Eigen::Map<const Vector3d>(position).allFinite() && quat.allFinite() && quat.squaredNorm() != 0;
}

void CollisionChecker::SetBodyPose(int body, const double position[3], const double quat_wxyz[4]) {
  if (body < 0 || body + 1 >= static_cast<int>(impl_->first_geom.size())) {
    throw InputError("there is no body " + std::to_string(body));
  }
  if (!IsPose(position, quat_wxyz)) {
    throw InputError("the pose of body " + std::to_string(body) + " is not finite, or its quaternion is 0");
  }
  const Vector3d p(position[0], position[1], position[2]);
  const Eigen::Quaterniond q(quat_wxyz[0], quat_wxyz[1], quat_wxyz[2], quat_wxyz[3]);
  const std::array<double, 7> pose = {p[0], p[1], p[2], q.w(), q.x(), q.y(), q.z()};
  if (pose == impl_->body_pose[body]) return;
  impl_->body_pose[body] = pose;
  const Matrix3d rotation = q.normalized().toRotationMatrix();
  for (int i = impl_->first_geom[body]; i < impl_->first_geom[body + 1]; ++i) {
    impl_->Place(i, p + rotation * impl_->geoms[i].local_position, rotation * impl_->geoms[i].local_rotation);
  }
}

const std::vector<contact_t>& CollisionChecker::FindContacts() {
  impl_->contacts.clear();
  Proximity touch;
  impl_->FindCandidates();
  for (const int candidate : impl_->candidates) {
    const Pair& pair = impl_->pairs[candidate];
    if (!impl_->Evaluate(pair, false, &touch)) continue;
    const Geom& a = impl_->geoms[pair.a];
    const Geom& b = impl_->geoms[pair.b];
    contact_t& contact = impl_->contacts.emplace_back();
    contact.geom_a = a.id;
    contact.geom_b = b.id;
    contact.distance_m = touch.distance;
    for (int i = 0; i < 3; ++i) {
      contact.position_m[i] = touch.point[i];
      contact.normal[i] = touch.normal[i];
    }
  }
  return impl_->contacts;
}

std::optional<Clearance> CollisionChecker::FindClearance(double below) {
  const auto& pairs = impl_->clearance_pairs;
  const auto gap = [&](int pair) {
    const Geom& a = impl_->geoms[pairs[pair].a];
    const Geom& b = impl_->geoms[pairs[pair].b];
    return (a.lower - b.upper).cwiseMax(b.lower - a.upper).cwiseMax(0).norm();
  };
  const auto measure = [&](int pair) {
    Proximity proximity;
    impl_->Evaluate(pairs[pair], true, &proximity);
    return proximity.distance;
  };
  const auto nearest = impl_->nearest->Find(below, gap, measure);
  if (!nearest) return std::nullopt;
  const Pair& pair = pairs[nearest->pair];
  Clearance clearance{.distance = nearest->distance,
                      .robot_geom = impl_->geoms[pair.a].id,
                      .scene_geom = impl_->geoms[pair.b].id};
  Vector3d robot, scene;
  impl_->FindPoints(pair, &robot, &scene);
  Eigen::Map<Vector3d>(clearance.robot_point.data()) = robot;
  Eigen::Map<Vector3d>(clearance.scene_point.data()) = scene;
  return clearance;
}

std::optional<Clearance> CollisionChecker::AsClearance(const contact_t& contact) const {
  const Geom& a = impl_->geoms[impl_->geom_of[contact.geom_a]];
  const Geom& b = impl_->geoms[impl_->geom_of[contact.geom_b]];
  const bool is_ours = a.is_moving_robot && b.is_scene;
  if (!is_ours && !(b.is_moving_robot && a.is_scene)) return std::nullopt;
  const auto& point = contact.position_m;
  return Clearance{.distance = contact.distance_m,
                   .robot_geom = is_ours ? a.id : b.id,
                   .scene_geom = is_ours ? b.id : a.id,
                   .robot_point = {point[0], point[1], point[2]},
                   .scene_point = {point[0], point[1], point[2]}};
}

bool CollisionChecker::IsChecked(int geom_a, int geom_b) const {
  return std::any_of(impl_->pairs.begin(), impl_->pairs.end(), [&](const Pair& pair) {
    return impl_->geoms[pair.a].id == std::min(geom_a, geom_b) &&
           impl_->geoms[pair.b].id == std::max(geom_a, geom_b);
  });
}

bool CollisionChecker::AreBodiesChecked(int body_a, int body_b) const {
  return std::any_of(impl_->pairs.begin(), impl_->pairs.end(), [&](const Pair& pair) {
    const int a = impl_->geoms[pair.a].body, b = impl_->geoms[pair.b].body;
    return (a == body_a && b == body_b) || (a == body_b && b == body_a);
  });
}

}  // namespace evalbus::collision
