// Smooth path of one arm through given joint positions.
#pragma once

#include <vector>

#include "policy_bridge/planning/kinematics.h"

namespace evalbus::policy {

// Natural cubic spline through knots that are equally spaced in the path parameter s, from 0 to 1.
class JointPath {
 public:
  // Needs at least one knot (rad). With a single knot, the arm stays there.
  explicit JointPath(std::vector<JointVector> knots);

  const std::vector<JointVector>& knots() const { return knots_; }
  JointVector At(double s) const;
  // Returns the derivative dq/ds at s.
  JointVector Slope(double s) const;

 private:
  std::vector<JointVector> knots_;
  // Second derivatives at the knots, for a knot spacing of 1.
  std::vector<JointVector> curvature_;
};

}  // namespace evalbus::policy
