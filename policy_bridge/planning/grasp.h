// Grasps of a box between two fingers.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace evalbus::policy {

// How a hand grasps an object: poses of its grip frame (see Arm) in the object's frame, before and at the
// grasp.
struct Grasp {
  Eigen::Isometry3d before, at;
};

// Box-shaped part of an object that a hand may grasp, in the object's frame; m.
struct GraspBox {
  Eigen::Vector3d half_extents;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

// Grip frame with these unit vectors as its z axis (away from the wrist) and y axis (the direction in which
// the pads close).
Eigen::Isometry3d GripFrame(const Eigen::Vector3d& position, const Eigen::Vector3d& approach,
                            const Eigen::Vector3d& closing);

// Distance between the poses before and at a grasp, along the hand's own axis, m.
inline constexpr double kGraspApproach = 0.09;

// Grasps of a box whose object is at `object` (world frame). The hand approaches each face that does not look
// down, closes on each pair of faces that fits between the fingers, with either finger in front. The point
// between the pads is at the box's center, or as deep as the fingers reach. leans: angles (rad) by which the
// hand is also tilted about the closing axis, to reach farther. Grasps are ordered by how little the hand
// must rotate from its pose `grip` (world frame).
std::vector<Grasp> BoxGrasps(const GraspBox& box, const Eigen::Isometry3d& object,
                             const Eigen::Isometry3d& grip, const std::vector<double>& leans = {0});

}  // namespace evalbus::policy
