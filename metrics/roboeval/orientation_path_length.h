// Orientation path length. Source: RoboEval's metrics page (orientation_path_length).
#pragma once

#include <array>
#include <vector>

#include "metrics/roboeval/by_arm.h"
#include "metrics/sample/rotation_angle.h"

namespace evalbus::metrics {

// Sum over samples i >= 1 of the rotation angle 2 acos(|u_i . u_(i-1)|) between unit quaternions, rad
// (metrics/sample/rotation_angle.h).
class OrientationPathLength {
 public:
  void Start() {
    has_last_ = false;
    length_ = 0;
  }

  void Add(const std::array<double, 4>& u) {
    if (has_last_) length_ += RotationAngle(u, last_);
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
