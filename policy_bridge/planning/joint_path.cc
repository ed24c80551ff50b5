#include "policy_bridge/planning/joint_path.h"

#include <algorithm>

namespace evalbus::policy {

JointPath::JointPath(std::vector<JointVector> knots) : knots_(std::move(knots)) {
  const size_t n = knots_.size();
  curvature_.assign(n, JointVector::Zero(knots_.front().size()));
  if (n < 3) return;
  // Solves c[i-1] + 4 c[i] + c[i+1] = 6 (q[i-1] - 2 q[i] + q[i+1]), with zero curvature c at the ends, by the
  // Thomas algorithm.
  std::vector<double> ratio(n, 0);
  for (size_t i = 1; i + 1 < n; ++i) {
    const double pivot = 4 - ratio[i - 1];
    ratio[i] = 1 / pivot;
    curvature_[i] = (6 * (knots_[i - 1] - 2 * knots_[i] + knots_[i + 1]) - curvature_[i - 1]) / pivot;
  }
  for (size_t i = n - 2; i > 0; --i) curvature_[i] -= ratio[i] * curvature_[i + 1];
}

JointVector JointPath::At(double s) const {
  if (knots_.size() == 1) return knots_.front();
  const double x = std::clamp(s, 0.0, 1.0) * static_cast<double>(knots_.size() - 1);
  const size_t i = std::min(static_cast<size_t>(x), knots_.size() - 2);
  const double b = x - static_cast<double>(i), a = 1 - b;
  return a * knots_[i] + b * knots_[i + 1] + (a * (a * a - 1) / 6) * curvature_[i] +
         (b * (b * b - 1) / 6) * curvature_[i + 1];
}

JointVector JointPath::Slope(double s) const {
  if (knots_.size() == 1) return JointVector::Zero(knots_.front().size());
  const double spans = static_cast<double>(knots_.size() - 1);
  const double x = std::clamp(s, 0.0, 1.0) * spans;
  const size_t i = std::min(static_cast<size_t>(x), knots_.size() - 2);
  const double b = x - static_cast<double>(i), a = 1 - b;
  return spans * (knots_[i + 1] - knots_[i] - ((3 * a * a - 1) / 6) * curvature_[i] +
                  ((3 * b * b - 1) / 6) * curvature_[i + 1]);
}

}  // namespace evalbus::policy
