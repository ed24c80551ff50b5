// Path length. Source: RoboEval's metrics page (cartesian_path_length, joint_path_length).
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "metrics/roboeval/by_arm.h"

namespace evalbus::metrics {

// Sum over samples i >= 1 of norm(x_i - x_(i-1)), in the unit of x. Joint angles are not unwrapped.
class PathLength {
 public:
  explicit PathLength(int dimension) : last_(dimension) {}

  void Start() {
    has_last_ = false;
    length_ = 0;
  }

  void Add(std::span<const double> x) {
    if (has_last_) {
      double sum = 0;
      for (size_t k = 0; k < last_.size(); ++k) sum += (x[k] - last_[k]) * (x[k] - last_[k]);
      length_ += std::sqrt(sum);
    }
    std::copy(x.begin(), x.end(), last_.begin());
    has_last_ = true;
  }

  double length() const { return length_; }

 private:
  std::vector<double> last_;
  bool has_last_ = false;
  double length_ = 0;
};

// Path length of each wrist, m.
class CartesianPath {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_cartesian_path_length;
  explicit CartesianPath(const MetricsConfig& config) : arms_(config.arms.size(), PathLength(3)) {}

  void Start(const ResetState&) { StartEach(&arms_); }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) arms_[k].Add(derived.sample.arm[k].wrist_position);
  }
  void Values(metric_values_t* values) const {
    FillEach(arms_, &PathLength::length, &values->cartesian_path_length_m);
  }

 private:
  std::vector<PathLength> arms_;
};

// Path length of each arm's joint positions, rad.
class JointPath {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_joint_path_length;
  explicit JointPath(const MetricsConfig& config) {
    for (const ArmConfig& arm : config.arms) arms_.emplace_back(arm.num_joints);
  }

  void Start(const ResetState&) { StartEach(&arms_); }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) arms_[k].Add(derived.sample.arm[k].joint_position);
  }
  void Values(metric_values_t* values) const {
    FillEach(arms_, &PathLength::length, &values->joint_path_length_rad);
  }

 private:
  std::vector<PathLength> arms_;
};

}  // namespace evalbus::metrics
