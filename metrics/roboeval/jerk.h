// Jerk by third differences. Source: RoboEval's metrics page (avg_/rms_cartesian_jerk, avg_/rms_joint_jerk).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "metrics/roboeval/by_arm.h"

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
  // The results are 0 without samples.
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

// Mean and root mean square over the samples of all arms together; 0 without samples.
inline double PooledMean(std::span<const Jerk> arms) {
  double sum = 0;
  int64_t count = 0;
  for (const Jerk& arm : arms) sum += arm.sum(), count += arm.count();
  return count > 0 ? sum / count : 0;
}

inline double PooledRms(std::span<const Jerk> arms) {
  double sum = 0;
  int64_t count = 0;
  for (const Jerk& arm : arms) sum += arm.sum_of_squares(), count += arm.count();
  return count > 0 ? std::sqrt(sum / count) : 0;
}

// Jerk of each wrist's position, m/s^3.
class CartesianJerk {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_cartesian_jerk;
  explicit CartesianJerk(const MetricsConfig& config)
      : arms_(config.arms.size(), Jerk(3, config.control_dt)) {}

  void Start(const ResetState&) { StartEach(&arms_); }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) {
      if (!derived.in_a_row) arms_[k].RestartHistory();
      arms_[k].Add(derived.sample.arm[k].wrist_position);
    }
  }
  void Values(metric_values_t* values) const {
    for (const Jerk& arm : arms_) values->num_jerk_samples = std::max(values->num_jerk_samples, arm.count());
    FillEach(arms_, &Jerk::mean, &values->avg_cartesian_jerk_mps3);
    FillEach(arms_, &Jerk::rms, &values->rms_cartesian_jerk_mps3);
    values->overall_avg_cartesian_jerk_mps3 = PooledMean(arms_);
    values->overall_rms_cartesian_jerk_mps3 = PooledRms(arms_);
  }

 private:
  std::vector<Jerk> arms_;
};

// Jerk of each arm's joint positions, rad/s^3.
class JointJerk {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_joint_jerk;
  explicit JointJerk(const MetricsConfig& config) {
    for (const ArmConfig& arm : config.arms) arms_.emplace_back(arm.num_joints, config.control_dt);
  }

  void Start(const ResetState&) { StartEach(&arms_); }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) {
      if (!derived.in_a_row) arms_[k].RestartHistory();
      arms_[k].Add(derived.sample.arm[k].joint_position);
    }
  }
  void Values(metric_values_t* values) const {
    for (const Jerk& arm : arms_) values->num_jerk_samples = std::max(values->num_jerk_samples, arm.count());
    FillEach(arms_, &Jerk::mean, &values->avg_joint_jerk_radps3);
    FillEach(arms_, &Jerk::rms, &values->rms_joint_jerk_radps3);
    values->overall_avg_joint_jerk_radps3 = PooledMean(arms_);
    values->overall_rms_joint_jerk_radps3 = PooledRms(arms_);
  }

 private:
  std::vector<Jerk> arms_;
};

}  // namespace evalbus::metrics
