// Path length. Source: RoboEval's metrics page (cartesian_path_length, joint_path_length).
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

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

}  // namespace evalbus::metrics
