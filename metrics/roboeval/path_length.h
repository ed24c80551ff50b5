// Path lengths. Source: RoboEval's metrics page (cartesian_path_length, joint_path_length,
// orientation_path_length).
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/roboeval/arm_quantities.h"

namespace evalbus::metrics {

// Sum over samples i >= 1 of the distance between x_i and x_(i-1), by arm.
template <class Quantity, auto kFlag, auto kLength>
class PathLength {
 public:
  static constexpr auto kTracked = kFlag;
  explicit PathLength(const MetricsConfig& config) : length_(config.arms.size()) {
    for (const ArmConfig& arm : config.arms) last_.emplace_back(Quantity::Dimension(arm));
  }

  void Start(const ResetState&) {
    has_last_ = false;
    length_.assign(length_.size(), 0);
  }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < last_.size(); ++k) {
      const std::span<const double> x = Quantity::Of(derived, k);
      if (has_last_) length_[k] += Quantity::Distance(x, last_[k]);
      std::copy(x.begin(), x.end(), last_[k].begin());
    }
    has_last_ = true;
  }
  void Values(metric_values_t* values) const { values->*kLength = length_; }

 private:
  std::vector<std::vector<double>> last_;
  bool has_last_ = false;
  std::vector<double> length_;
};

using CartesianPath = PathLength<WristPosition, &metric_values_t::tracks_cartesian_path_length,
                                 &metric_values_t::cartesian_path_length_m>;
using JointPath = PathLength<JointPositions, &metric_values_t::tracks_joint_path_length,
                             &metric_values_t::joint_path_length_rad>;
using OrientationPath = PathLength<WristOrientation, &metric_values_t::tracks_orientation_path_length,
                                   &metric_values_t::orientation_path_length_rad>;

}  // namespace evalbus::metrics
