// How differently high the two wrists are. Source: RoboEval's metrics page
// (bimanual_gripper_vertical_difference).
#pragma once

#include <cmath>
#include <cstdint>

namespace evalbus::metrics {

// Mean over samples of |z left - z right| of the wrists, m.
class GripperHeightDifference {
 public:
  void Start() { *this = {}; }

  void Add(double left_z, double right_z) {
    sum_ += std::abs(left_z - right_z);
    ++count_;
  }

  double mean() const { return count_ > 0 ? sum_ / count_ : 0; }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

}  // namespace evalbus::metrics
