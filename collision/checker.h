// Checks collisions of a compiled MuJoCo model for given body poses. Finds touching geom pairs with depth,
// point and normal, and the robot's clearance to the scene. Needs no mjData and no simulation. Uses FCL and
// closed forms.
//
// The result depends only on the poses, not on earlier calls. Equal poses give bit-identical results. Not
// thread-safe; use one checker per thread.
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
  // The two points between which the distance is measured, world frame, m. For a touching pair, both are its
  // contact point.
  std::array<double, 3> robot_point{};
  std::array<double, 3> scene_point{};
};

// Returns true if SetBodyPose accepts these numbers: all are finite, and the quaternion can be normalized.
bool IsPose(const double position[3], const double quat_wxyz[4]);

class CollisionChecker {
 public:
  // Copies the required data from both arguments. `info` defines which entity owns each body and which geoms
  // are gripper pads. Throws InputError if they do not describe the same model, or if the shape of a
  // colliding geom is not supported.
  //
  // The checker checks the pairs that MuJoCo would check (contype and conaffinity, <pair>, <exclude>, bodies
  // welded together, parent and child; margin and gap are ignored). Two kinds of pairs are excepted:
  // neighboring links of one robot, even if the lower link is fixed to the world, and fingers of the same
  // gripper.
  CollisionChecker(const mjModel* model, const model_info_t& info);
  ~CollisionChecker();
  CollisionChecker(const CollisionChecker&) = delete;
  CollisionChecker& operator=(const CollisionChecker&) = delete;

  // Sets the pose of a body frame in the world: position in m, quaternion w x y z (normalized here). The pose
  // of every body must be set once before the first check, and remains until it is set again. Throws
  // InputError if there is no such body or the pose is invalid (IsPose).
  void SetBodyPose(int body, const double position[3], const double quat_wxyz[4]);

  // Returns all touching pairs, sorted by (geom_a, geom_b), geom_a < geom_b. Each has its deepest point,
  // midway between the two surfaces, and the normal from geom_a to geom_b. Valid until the next call.
  const std::vector<contact_t>& FindContacts();

  // Returns the smallest signed distance between the moving links of the robot and the world or fixtures.
  // Manipulated objects and robot bodies welded to the world do not count. Empty if there is no such pair, or
  // if none is nearer than `below`. A finite `below` makes the call much cheaper if the bodies have moved
  // little since the last call.
  std::optional<Clearance> FindClearance(double below = std::numeric_limits<double>::infinity());

  // Converts a contact of FindContacts() to a clearance. Empty if its pair does not count for the clearance.
  std::optional<Clearance> AsClearance(const contact_t& contact) const;

  // Returns whether the pair is checked for contact.
  bool IsChecked(int geom_a, int geom_b) const;
  // Returns whether any geom of one body is checked against a geom of the other.
  bool AreBodiesChecked(int body_a, int body_b) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus::collision
