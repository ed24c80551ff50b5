// Collision checking of a compiled MuJoCo model from body poses alone: touching geom pairs with depth, point
// and normal, and the robot's clearance to the scene. Needs no mjData and no simulation; uses FCL and closed
// forms.
//
// The result depends on the poses only, never on earlier calls: equal poses give equal bits.
// Not thread-safe; one checker per thread.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <evalbus/contact_t.hpp>
#include <evalbus/model_info_t.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace evalbus::collision {

struct Clearance {
  // Signed distance, meters; negative in penetration.
  double distance = 0;
  int robot_geom = -1;
  int scene_geom = -1;
  // Where they are that far from one another, world frame, m; of a touching pair both are its contact point.
  std::array<double, 3> robot_point{};
  std::array<double, 3> scene_point{};
};

// Whether SetBodyPose takes these numbers: all are finite, and the quaternion can be normalized.
bool IsPose(const double position[3], const double quat_wxyz[4]);

class CollisionChecker {
 public:
  // Copies what it needs from both. `info` says which entity owns each body and which geoms are gripper pads.
  // Throws InputError when they do not describe the same model or a colliding geom has a shape that is not
  // supported.
  //
  // Pairs checked: those that MuJoCo would check (contype and conaffinity, <pair>, <exclude>, bodies welded
  // together, parent and child; margin and gap are ignored), less neighboring links of one robot, also where
  // the lower one is fixed to the world, and less the fingers of one gripper among themselves.
  CollisionChecker(const mjModel* model, const model_info_t& info);
  ~CollisionChecker();
  CollisionChecker(const CollisionChecker&) = delete;
  CollisionChecker& operator=(const CollisionChecker&) = delete;

  // Pose of a body frame in the world: meters, quaternion w x y z (normalized here). Every body must be set
  // once before the first check; later it keeps its pose until set again. Throws InputError for what is no
  // pose (IsPose).
  void SetBodyPose(int body, const double position[3], const double quat_wxyz[4]);

  // All touching pairs, sorted by (geom_a, geom_b), geom_a < geom_b, each with its deepest point, midway
  // between the two surfaces, and the normal from geom_a to geom_b. Valid until the next call.
  const std::vector<contact_t>& FindContacts();

  // Smallest signed distance between the moving part of the robot and the world and fixtures. Manipulated
  // objects and robot bodies welded to the world do not count. Empty when there is no such pair, or none
  // nearer than `below`; then it is much cheaper where the bodies have moved little since the last call.
  std::optional<Clearance> FindClearance(double below = std::numeric_limits<double>::infinity());

  // A contact of FindContacts() as such a distance, where its pair is one that counts.
  std::optional<Clearance> AsClearance(const contact_t& contact) const;

  // Whether the pair is checked at all.
  bool IsChecked(int geom_a, int geom_b) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus::collision
