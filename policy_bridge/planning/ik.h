// Inverse kinematics by damped least squares.
#pragma once

#include "policy_bridge/planning/kinematics.h"

namespace evalbus::policy {

struct IkOptions {
  // Joint positions near which a redundant arm stays. If empty, the initial joint positions of the search.
  JointVector posture;
  double tolerance = 1e-6;  // m and rad
  int max_iterations = 60;
};

struct IkResult {
  JointVector joints;  // rad, within limits
  bool converged = false;
  int iterations = 0;
};

// Finds joint positions whose wrist pose is `target` (world frame), starting from `start`. Each iteration
// solves dq = J^T (J J^T + (0.1 e^2 + c) I)^-1 e + 0.1 N (posture - q) with pose error e. The damping
// vanishes with the error (Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt
// method", IEEE T-RO 2011). The search is therefore stable if the target is out of reach, and converges
// quadratically near a solution. A joint at its limit that an iteration would push farther is excluded from
// that iteration.
IkResult SolveIk(const ArmChain& arm, const Eigen::Isometry3d& target, const JointVector& start,
                 const IkOptions& options = {});

// Returns the translation (m) and rotation vector (rad) from pose a to pose b, in the world frame.
Eigen::Matrix<double, 6, 1> PoseDifference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

}  // namespace evalbus::policy
