// Inverse kinematics by damped least squares.
#pragma once

#include "policy_bridge/planning/kinematics.h"

namespace evalbus::policy {

struct IkOptions {
  // Joint positions that the arm's redundancy is spent on being near to; the start if empty.
  JointVector posture;
  double tolerance = 1e-6;  // m, and rad
  int max_iterations = 60;
};

struct IkResult {
  JointVector joints;  // rad, within limits
  bool converged = false;
  int iterations = 0;
};

// Joint positions whose wrist pose is `target` (world frame), searched from `start`. Each step solves
//   dq = J^T (J J^T + (e^2 + c) I)^-1 e + N (posture - q)
// with pose error e; damping that vanishes with the error (Sugihara, "Solvability-unconcerned inverse
// kinematics by the Levenberg-Marquardt method", IEEE T-RO 2011) is stable out of reach and quadratic near
// the solution. A joint that a step pushes against its limit is left out of that step.
IkResult SolveIk(const ArmChain& arm, const Eigen::Isometry3d& target, const JointVector& start,
                 const IkOptions& options = {});

// Position (m) and rotation vector (rad), world frame, from pose a to pose b.
Eigen::Matrix<double, 6, 1> PoseDifference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

}  // namespace evalbus::policy
