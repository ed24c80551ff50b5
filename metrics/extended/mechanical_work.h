// Mechanical work of each arm. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Integral over time of |torque . velocity|, the magnitude of the arm's mechanical power, J. Braking counts
// as work too. The sim integrates at every physics step. Samples would not suffice: they are taken at the end
// of a control tick, where power is smallest because the servos have caught up with their commands. There is
// no value if the source does not provide the work.
class MechanicalWork : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"mechanical_work_J"};
  explicit MechanicalWork(const MetricsConfig& config) : work_(config.arms.size()) {}

  void Start() override { work_.assign(work_.size(), kNone); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < work_.size(); ++k)
      work_[k] = derived.sample.arm[k].mechanical_work.value_or(kNone);
  }
  void Values(std::span<double> values) const override {
    std::copy(work_.begin(), work_.end(), values.begin());
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> work_;
};

}  // namespace evalbus::metrics
