// How differently fast the two arms move. Source: RoboEval's metrics page (bimanual_arm_velocity_difference).
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

namespace evalbus::metrics {

// Mean over samples of |norm(w left) - norm(w right)|, rad/s, with w the measured joint velocities: a
// difference of speeds, not of velocities.
class ArmSpeedDifference {
 public:
  void Start() { *this = {}; }

  void Add(std::span<const double> left, std::span<const double> right) {
    sum_ += std::abs(Norm(left) - Norm(right));
    ++count_;
  }

  double mean() const { return count_ > 0 ? sum_ / count_ : 0; }

 private:
  static double Norm(std::span<const double> x) {
    double sum = 0;
    for (double value : x) sum += value * value;
    return std::sqrt(sum);
  }
  double sum_ = 0;
  int64_t count_ = 0;
};

}  // namespace evalbus::metrics
