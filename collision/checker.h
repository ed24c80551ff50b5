// Checks collisions of a compiled MuJoCo model for given body poses: touching geom pairs with depth, point
// and normal, and the robot's clearance to the scene. Needs no mjData and no simulation. Uses FCL and closed
// forms.
//
// The result depends only on the poses, not on earlier calls: equal poses give equal bits. Not thread-safe;
// use one checker per thread.
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
  // Signed distance, m; negative in penetration.
  double distance = 0;
  int robot_geom = -1;
  int scene_geom = -1;
  // The two points at this distance, world frame, m. For a touching pair, both are its contact point.
  std::array<double, 3> robot_point{};
  std::array<double, 3> scene_point{};
};

// True if SetBodyPose accepts these numbers: all are finite, and the quaternion can be normalized.
bool IsPose(const double position[3], const double quat_wxyz[4]);

class CollisionChecker {
 public:
  // Copies the required data from both arguments. `info` defines which entity owns each body and which geoms
  // are gripper pads. Throws InputError if they do not describe the same model, or if the shape of a
  // colliding geom is not supported.
  //
  // Checked pairs: those that MuJoCo would check (contype and conaffinity, <pair>, <exclude>, bodies welded
  // together, parent and child; margin and gap are ignored). Exceptions: neighboring links of one robot, also
  // if the lower one is fixed to the world, and the fingers of one gripper among themselves.
  CollisionChecker(const mjModel* model, const model_info_t& info);
  ~CollisionChecker();
  CollisionChecker(const CollisionChecker&) = delete;
  CollisionChecker& operator=(const CollisionChecker&) = delete;

  // Sets the pose of a body frame in the world: m, quaternion w x y z (normalized here). Every body must be
  // set once before the first check and keeps its pose until set again. Throws InputError if the pose is
  // invalid (IsPose).
  void SetBodyPose(int body, const double position[3], const double quat_wxyz[4]);

  // Returns all touching pairs, sorted by (geom_a, geom_b), geom_a < geom_b. Each has its deepest point,
  // midway between the two surfaces, and the normal from geom_a to geom_b. Valid until the next call.
  const std::vector<contact_t>& FindContacts();

  // Smallest signed distance between the moving part of the robot and the world and fixtures. Manipulated
  // objects and robot bodies welded to the world do not count. Empty if there is no such pair, or none nearer
  // than `below`. A finite `below` makes the call much cheaper if the bodies have moved little since the last
  // call.
  std::optional<Clearance> FindClearance(double below = std::numeric_limits<double>::infinity());

  // Converts a contact of FindContacts() to a clearance. Empty if its pair does not count for the clearance.
  std::optional<Clearance> AsClearance(const contact_t& contact) const;

  // True if the pair is checked at all.
  bool IsChecked(int geom_a, int geom_b) const;
  // True if any geoms of these bodies are checked.
  bool AreBodiesChecked(int body_a, int body_b) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus::collision
