// Jerk by third differences. Source: RoboEval's metrics page (avg_/rms_cartesian_jerk, avg_/rms_joint_jerk).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/roboeval/arm_quantities.h"

namespace evalbus::metrics {

// j_i = (x_i - 3 x_(i-1) + 3 x_(i-2) - x_(i-3)) / dt^3 for i >= 3; mean and root mean square of norm(j_i), in
// the unit of x per s^3. dt is the simulated time between ticks (s). The terms are grouped in pairs, so that
// an arm at rest yields exactly 0.
class Jerk {
 public:
  Jerk(int dimension, double dt)
      : dimension_(dimension), inverse_dt3_(1 / (dt * dt * dt)), history_(3 * dimension) {}

  void Start() {
    RestartHistory();
    count_ = 0;
    sum_ = sum_of_squares_ = 0;
  }

  // Must be called after a missing sample, because the third difference needs four consecutive samples.
  void RestartHistory() { filled_ = 0; }

  void Add(std::span<const double> x) {
    // history_ is a ring of three samples; newest_ is the slot of x_(i-1), the next slot holds x_(i-3).
    double* x1 = &history_[newest_ * dimension_];
    double* x3 = &history_[(newest_ + 1) % 3 * dimension_];
    const double* x2 = &history_[(newest_ + 2) % 3 * dimension_];
    if (filled_ == 3) {
      double sum = 0;
      for (int k = 0; k < dimension_; ++k) {
        const double difference = (x[k] - x3[k]) - 3 * (x1[k] - x2[k]);
        sum += difference * difference;
      }
      const double jerk = std::sqrt(sum) * inverse_dt3_;
      sum_ += jerk;
      sum_of_squares_ += jerk * jerk;
      ++count_;
    } else {
      ++filled_;
    }
    newest_ = (newest_ + 1) % 3;
    for (int k = 0; k < dimension_; ++k) x3[k] = x[k];
  }

  int64_t count() const { return count_; }
  double sum() const { return sum_; }
  double sum_of_squares() const { return sum_of_squares_; }
  // The results are 0 if there are no samples.
  double mean() const { return count_ > 0 ? sum_ / count_ : 0; }
  double rms() const { return count_ > 0 ? std::sqrt(sum_of_squares_ / count_) : 0; }

 private:
  int dimension_;
  double inverse_dt3_;
  std::vector<double> history_;
  int newest_ = 0;
  int filled_ = 0;
  int64_t count_ = 0;
  double sum_ = 0;
  double sum_of_squares_ = 0;
};

// Jerk by arm, and over the samples of all arms together.
template <class Quantity, auto kFlag, auto kAvg, auto kRms, auto kOverallAvg, auto kOverallRms>
class ArmJerk {
 public:
  static constexpr auto kTracked = kFlag;
  explicit ArmJerk(const MetricsConfig& config) {
    for (const ArmConfig& arm : config.arms) arms_.emplace_back(Quantity::Dimension(arm), config.control_dt);
  }

  void Start(const ResetState&) {
    for (Jerk& arm : arms_) arm.Start();
  }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) {
      if (!derived.in_a_row) arms_[k].RestartHistory();
      arms_[k].Add(Quantity::Of(derived, k));
    }
  }
  void Values(metric_values_t* values) const {
    (values->*kAvg).resize(arms_.size());
    (values->*kRms).resize(arms_.size());
    double sum = 0, sum_of_squares = 0;
    int64_t count = 0;
    for (size_t k = 0; k < arms_.size(); ++k) {
      const Jerk& arm = arms_[k];
      (values->*kAvg)[k] = arm.mean();
      (values->*kRms)[k] = arm.rms();
      sum += arm.sum();
      sum_of_squares += arm.sum_of_squares();
      count += arm.count();
      values->num_jerk_samples = std::max(values->num_jerk_samples, arm.count());
    }
    values->*kOverallAvg = count > 0 ? sum / count : 0;
    values->*kOverallRms = count > 0 ? std::sqrt(sum_of_squares / count) : 0;
  }

 private:
  std::vector<Jerk> arms_;
};

using CartesianJerk =
    ArmJerk<WristPosition, &metric_values_t::tracks_cartesian_jerk, &metric_values_t::avg_cartesian_jerk_mps3,
            &metric_values_t::rms_cartesian_jerk_mps3, &metric_values_t::overall_avg_cartesian_jerk_mps3,
            &metric_values_t::overall_rms_cartesian_jerk_mps3>;
using JointJerk =
    ArmJerk<JointPositions, &metric_values_t::tracks_joint_jerk, &metric_values_t::avg_joint_jerk_radps3,
            &metric_values_t::rms_joint_jerk_radps3, &metric_values_t::overall_avg_joint_jerk_radps3,
            &metric_values_t::overall_rms_joint_jerk_radps3>;

}  // namespace evalbus::metrics
