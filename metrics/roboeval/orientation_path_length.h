// Orientation path length. Source: RoboEval's metrics page (orientation_path_length).
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "metrics/roboeval/by_arm.h"

namespace evalbus::metrics {

// Sum over samples i >= 1 of the rotation angle 2 acos(|u_i . u_(i-1)|) between unit quaternions, rad. q and
// -q are the same orientation, so a step is at most pi. It is evaluated as 4 atan2(|a - b|, |a + b|) with b's
// sign such that a . b >= 0. This equals the arc cosine but is exact for small angles, where the arc cosine
// turns one rounding error into 2e-8 rad.
class OrientationPathLength {
 public:
  void Start() {
    has_last_ = false;
    length_ = 0;
  }

  void Add(const std::array<double, 4>& u) {
    if (has_last_) {
      double dot = 0;
      for (int k = 0; k < 4; ++k) dot += u[k] * last_[k];
      const double sign = dot < 0 ? -1 : 1;
      double difference = 0, sum = 0;
      for (int k = 0; k < 4; ++k) {
        const double d = u[k] - sign * last_[k], s = u[k] + sign * last_[k];
        difference += d * d;
        sum += s * s;
      }
      length_ += 4 * std::atan2(std::sqrt(difference), std::sqrt(sum));
    }
    last_ = u;
    has_last_ = true;
  }

  double length() const { return length_; }

 private:
  std::array<double, 4> last_{};
  bool has_last_ = false;
  double length_ = 0;
};

// Orientation path length of each wrist, rad.
class OrientationPath {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_orientation_path_length;
  explicit OrientationPath(const MetricsConfig& config) : arms_(config.arms.size()) {}

  void Start(const ResetState&) { StartEach(&arms_); }
  void Add(const DerivedSample& derived) {
    for (size_t k = 0; k < arms_.size(); ++k) arms_[k].Add(derived.wrist_quat[k]);
  }
  void Values(metric_values_t* values) const {
    FillEach(arms_, &OrientationPathLength::length, &values->orientation_path_length_rad);
  }

 private:
  std::vector<OrientationPathLength> arms_;
};

}  // namespace evalbus::metrics
