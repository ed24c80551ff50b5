// Grasps of a box between two fingers.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace evalbus::policy {

// Poses of a hand's grip frame (see Arm) in the frame of the object that it grasps: before the grasp, and at
// the grasp.
struct Grasp {
  Eigen::Isometry3d before, at;
};

// Box-shaped part of an object that a hand may grasp. Lengths in m, in the object's frame.
struct GraspBox {
  Eigen::Vector3d half_extents;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

// Returns the grip frame whose z axis (away from the wrist) is `approach` and whose y axis (the direction in
// which the pads close) is `closing`. Both must be unit vectors.
Eigen::Isometry3d GripFrame(const Eigen::Vector3d& position, const Eigen::Vector3d& approach,
                            const Eigen::Vector3d& closing);

// Distance between the poses before the grasp and at the grasp, along the hand's own axis, m.
inline constexpr double kGraspApproach = 0.09;

// Returns grasps of a box whose object has the pose `object` (world frame). There is one grasp for each
// approach to a face that does not come from below, each pair of faces that fits between the fingers, each of
// the two orientations of the fingers, and each angle of `leans`. The point between the pads is at the box's
// center, or as deep as the fingers reach. leans: angles (rad) by which the hand is tilted about the closing
// axis, to reach farther. The grasps with the smallest sum of |lean| and of the angle of rotation from the
// hand's pose `grip` (world frame) come first.
std::vector<Grasp> BoxGrasps(const GraspBox& box, const Eigen::Isometry3d& object,
                             const Eigen::Isometry3d& grip, const std::vector<double>& leans = {0});

}  // namespace evalbus::policy
