// Slips: objects lost from a gripper. Source: RoboEval's metrics page (slip_count, slip_count_per_object).
#pragma once

#include <cstdint>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

struct Slip {
  int object;
  int gripper;
  int64_t tick;  // tick at which the slip was detected
};

// Evaluates samples 0, W, 2W, ... An (object, gripper) pair slips if the object was held in the previous
// evaluated sample (initially the reset state), is not held now, and the gripper opening has not increased.
// If two grippers lose one object, that is two slips.
class SlipCounter {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_slippage;
  explicit SlipCounter(const MetricsConfig& config)
      : window_(config.slip_sample_window),
        held_(config.objects.size() * config.grippers.size()),
        opening_(config.grippers.size()),
        count_(config.objects.size()) {
    slips_.reserve(256);
  }

  void Start(const ResetState& reset) {
    samples_ = 0;
    count_.assign(count_.size(), 0);
    slips_.clear();
    Remember(reset.gripper_opening, reset.holding);
  }

  void Add(const DerivedSample& derived) {
    if (samples_++ % window_ != 0) return;
    const std::span<const double> opening = derived.sample.gripper_opening;
    const std::span<const uint8_t> holding = derived.sample.holding;
    const size_t grippers = opening_.size();
    for (size_t object = 0; object < count_.size(); ++object) {
      for (size_t gripper = 0; gripper < grippers; ++gripper) {
        const size_t pair = object * grippers + gripper;
        if (!held_[pair] || holding[pair] || !(opening[gripper] <= opening_[gripper])) continue;
        ++count_[object];
        slips_.push_back({static_cast<int>(object), static_cast<int>(gripper), derived.sample.tick});
      }
    }
    Remember(opening, holding);
  }

  void Values(metric_values_t* values) const {
    values->slip_count = static_cast<int64_t>(slips_.size());
    values->slip_count_per_object = count_;
  }
  // Returns all slips so far, in chronological order.
  const std::vector<Slip>& slips() const { return slips_; }

 private:
  void Remember(std::span<const double> opening, std::span<const uint8_t> holding) {
    opening_.assign(opening.begin(), opening.end());
    held_.assign(holding.begin(), holding.end());
  }

  int64_t window_;
  int64_t samples_ = 0;
  std::vector<uint8_t> held_;
  std::vector<double> opening_;
  std::vector<int64_t> count_;
  std::vector<Slip> slips_;
};

}  // namespace evalbus::metrics
