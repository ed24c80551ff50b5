// Forces with which the robot presses on the scene, on objects and on itself. Defined by evalbus
// (docs/metrics.md).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "metrics/extended/extended_metric.h"
#include "metrics/sample/quantile.h"

namespace evalbus::metrics {

// Peak and 95th percentile of the force (N) with which the robot presses on the scene, on manipulated
// objects, or on itself. Only physics steps with such a force count, and each counts with the largest force
// of a pair of bodies. Without such steps, the peak is 0 and the percentile does not exist. The percentile is
// computed only at the end of the episode. There is no value if the source does not provide forces.
class ContactForces : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"p95_object_force_N",  "p95_scene_force_N",  "p95_self_force_N",
                                           "peak_object_force_N", "peak_scene_force_N", "peak_self_force_N"};
  explicit ContactForces(const MetricsConfig& /*config*/) {
    // Enough for 30 s of contact at 500 physics steps per second. More steps require a reallocation.
    for (std::vector<double>& forces : forces_) forces.reserve(15000);
  }

  void Start() override {
    for (std::vector<double>& forces : forces_) forces.clear();
    peak_.fill(std::numeric_limits<double>::quiet_NaN());
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    const ForceSample& forces = *derived.sample.forces;
    const std::array added = {forces.object, forces.scene, forces.self};
    for (size_t k = 0; k < added.size(); ++k) {
      forces_[k].insert(forces_[k].end(), added[k].begin(), added[k].end());
      // Replaces NaN, which means that forces are unknown, by 0: fmax() ignores a NaN operand.
      peak_[k] = std::fmax(peak_[k], 0);
      for (const double force : added[k]) peak_[k] = std::max(peak_[k], force);
    }
  }
  void Values(std::span<double> values) const override {
    std::fill(values.begin(), values.end(), std::numeric_limits<double>::quiet_NaN());
    std::copy(peak_.begin(), peak_.end(), values.begin() + static_cast<ptrdiff_t>(forces_.size()));
  }
  void FinalValues(int64_t /*last_tick*/, std::span<double> values) const override {
    Values(values);
    for (size_t k = 0; k < forces_.size(); ++k) {
      std::vector<double> sorted = forces_[k];
      std::sort(sorted.begin(), sorted.end());
      values[k] = Quantile(sorted, 0.95);
    }
  }

 private:
  // Forces of all steps, and peak force: on objects, on the scene, and on the robot itself.
  std::array<std::vector<double>, 3> forces_;
  std::array<double, 3> peak_{};
};

}  // namespace evalbus::metrics
