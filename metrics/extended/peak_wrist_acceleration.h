// Peak acceleration of each wrist. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Largest norm(p_i - 2 p_(i-1) + p_(i-2)) / dt^2 over three consecutive samples, m/s^2; 0 if there are none.
class PeakWristAcceleration : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_wrist_acceleration_mps2"};
  explicit PeakWristAcceleration(const MetricsConfig& config)
      : dt_(config.control_dt), arms_(config.arms.size()) {}

  void Start() override {
    arms_.assign(arms_.size(), {});
    filled_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.in_a_row) filled_ = 0;
    for (size_t k = 0; k < arms_.size(); ++k) {
      Arm& arm = arms_[k];
      const std::array<double, 3>& p = derived.sample.arm[k].wrist_position;
      if (filled_ == 2) {
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
          const double difference = p[i] - 2 * arm.p1[i] + arm.p2[i];
          sum += difference * difference;
        }
        arm.peak = std::max(arm.peak, std::sqrt(sum) / (dt_ * dt_));
      }
      arm.p2 = arm.p1;
      arm.p1 = p;
    }
    filled_ = std::min(filled_ + 1, 2);
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < arms_.size(); ++k) values[k] = arms_[k].peak;
  }

 private:
  struct Arm {
    std::array<double, 3> p1{}, p2{};  // p_(i-1), p_(i-2)
    double peak = 0;
  };
  double dt_;
  std::vector<Arm> arms_;
  // Number of positions among p1 and p2 that are from the consecutive samples just before the next one.
  int filled_ = 0;
};

}  // namespace evalbus::metrics
