// Ways to take a box between two fingers.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace evalbus::policy {

// How a hand takes an object: poses of its grip frame (see Arm) in the object's frame, before and at the
// grasp.
struct Grasp {
  Eigen::Isometry3d before, at;
};

// The box-shaped part of an object that a hand may take, in the object's frame; m.
struct GraspBox {
  Eigen::Vector3d half_extents;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

// A grip frame with these unit vectors as its z (away from the wrist) and y (the way the pads close).
Eigen::Isometry3d GripFrame(const Eigen::Vector3d& position, const Eigen::Vector3d& approach,
                            const Eigen::Vector3d& closing);

// The hand backs off this far along its own axis to be before a grasp, m.
inline constexpr double kGraspApproach = 0.09;

// Grasps of a box whose object is at `object` (world): through each face that does not look down, closing on
// each pair of faces that fits between the fingers, either finger in front; the pads' middle is at the box's
// center, or as deep as the fingers reach. leans: angles (rad) by which the hand also leans about the closing
// axis, to reach farther. Those that turn the hand least from its pose `grip` (world) come first.
std::vector<Grasp> BoxGrasps(const GraspBox& box, const Eigen::Isometry3d& object,
                             const Eigen::Isometry3d& grip, const std::vector<double>& leans = {0});

}  // namespace evalbus::policy
