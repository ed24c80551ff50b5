// Extended metrics about the arms' effort. Ours (docs/metrics.md).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace evalbus {

// Sum over samples of |torque . velocity| dt, J: the magnitude of the arm's mechanical power, so that braking
// costs too.
class MechanicalWork {
 public:
  explicit MechanicalWork(double dt) : dt_(dt) {}
  void Start() { sum_ = 0; }
  void Add(std::span<const double> torque, std::span<const double> velocity) {
    double power = 0;
    for (size_t k = 0; k < torque.size(); ++k) power += torque[k] * velocity[k];
    sum_ += std::abs(power);
  }
  double work() const { return sum_ * dt_; }

 private:
  double dt_;
  double sum_ = 0;
};

// Largest norm(p_i - p_(i-1)) / dt over consecutive samples, m/s.
class PeakSpeed {
 public:
  explicit PeakSpeed(double dt) : dt_(dt) {}
  void Start() {
    RestartHistory();
    peak_ = 0;
  }
  // After a missing sample: the two samples around the hole are not dt apart.
  void RestartHistory() { has_last_ = false; }
  void Add(const std::array<double, 3>& p) {
    if (has_last_) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += (p[k] - last_[k]) * (p[k] - last_[k]);
      peak_ = std::max(peak_, std::sqrt(sum) / dt_);
    }
    last_ = p;
    has_last_ = true;
  }
  double peak() const { return peak_; }

 private:
  double dt_;
  std::array<double, 3> last_{};
  bool has_last_ = false;
  double peak_ = 0;
};

}  // namespace evalbus
