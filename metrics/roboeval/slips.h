// Lost grips. Source: RoboEval's metrics page (slip_count, slip_count_per_object).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace evalbus::metrics {

struct Slip {
  int object;
  int gripper;
  int64_t tick;  // at which it was seen
};

// Looks at samples 0, W, 2W, ... An (object, gripper) pair slips when it was held at the previous look (the
// reset state before the first), is not held now, and the opening is not larger than at the previous look.
// Two grippers that lose one object are two slips.
class SlipCounter {
 public:
  SlipCounter(int objects, int grippers, int window)
      : window_(window), held_(objects * grippers), opening_(grippers), count_(objects) {
    slips_.reserve(256);
  }

  // The reset state. `holding` is [object * grippers + gripper].
  void Start(std::span<const double> opening, std::span<const uint8_t> holding) {
    samples_ = 0;
    count_.assign(count_.size(), 0);
    slips_.clear();
    Remember(opening, holding);
  }

  void Add(int64_t tick, std::span<const double> opening, std::span<const uint8_t> holding) {
    if (samples_++ % window_ != 0) return;
    const size_t grippers = opening_.size();
    for (size_t object = 0; object < count_.size(); ++object) {
      for (size_t gripper = 0; gripper < grippers; ++gripper) {
        const size_t pair = object * grippers + gripper;
        if (!held_[pair] || holding[pair] || !(opening[gripper] <= opening_[gripper])) continue;
        ++count_[object];
        slips_.push_back({static_cast<int>(object), static_cast<int>(gripper), tick});
      }
    }
    Remember(opening, holding);
  }

  const std::vector<int64_t>& per_object() const { return count_; }
  int64_t total() const { return static_cast<int64_t>(slips_.size()); }
  // In order of time.
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
