#include "policy_bridge/planning/ik.h"

#include <Eigen/Cholesky>

namespace evalbus::policy {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kMinDamping = 1e-7;
constexpr double kErrorDamping = 0.1;
constexpr double kPostureGain = 0.1;
// Largest change of a joint per iteration, rad. It keeps the search on its solution branch.
constexpr double kMaxStep = 0.3;

}  // namespace

Vector6 PoseDifference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(b.linear() * a.linear().transpose()));
  Vector6 difference;
  difference << b.translation() - a.translation(), turn.angle() * turn.axis();
  return difference;
}

IkResult SolveIk(const ArmChain& arm, const Eigen::Isometry3d& target, const JointVector& start,
                 const IkOptions& options) {
  const JointVector& posture = options.posture.size() ? options.posture : start;
  IkResult result;
  result.joints = start.cwiseMax(arm.lower()).cwiseMin(arm.upper());
  Jacobian jacobian;
  for (;; ++result.iterations) {
    const Vector6 error = PoseDifference(arm.Forward(result.joints, &jacobian), target);
    if (error.head<3>().norm() <= options.tolerance && error.tail<3>().norm() <= options.tolerance) {
      result.converged = true;
      return result;
    }
    if (result.iterations == options.max_iterations) return result;

    JointVector step;
    // The second pass excludes the joints that the first pass would move out of their range.
    for (int pass = 0; pass < 2; ++pass) {
      const double damping = kMinDamping + kErrorDamping * error.squaredNorm();
      const Matrix6 normal = jacobian * jacobian.transpose() + damping * Matrix6::Identity();
      const JointVector wish = kPostureGain * (posture - result.joints);
      const Vector6 dual = normal.ldlt().solve(error - jacobian * wish);
      step = jacobian.transpose() * dual + wish;
      bool blocked = false;
      for (Eigen::Index i = 0; i < step.size(); ++i) {
        const double q = result.joints[i] + step[i];
        if ((result.joints[i] <= arm.lower()[i] && q < arm.lower()[i]) ||
            (result.joints[i] >= arm.upper()[i] && q > arm.upper()[i])) {
          jacobian.col(i).setZero();
          blocked = true;
        }
      }
      if (!blocked) break;
    }
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > kMaxStep) step *= kMaxStep / largest;
    result.joints = (result.joints + step).cwiseMax(arm.lower()).cwiseMin(arm.upper());
  }
}

}  // namespace evalbus::policy
