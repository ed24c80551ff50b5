// Computes the control ticks between the samples of an external source, and which ticks are missing. The same
// rule applies to live sources and files. Tick k is the time k control periods after the first sample. It
// lies between two neighbors: the last sample before it and the first sample at or after it. Ticks are
// missing
//   - if their neighbors are farther apart than both three ticks and three times the usual sample interval,
//   - if a sample between their neighbors was refused; if no tick lies there, the next tick is missing.
// Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "sim/measured_scene.h"

namespace evalbus::sim {

class SampleTicks {
 public:
  // tick_s: control period. usual_s: nominal time between two samples.
  SampleTicks(double tick_s, double usual_s)
      : tick_s_(tick_s), longest_s_(kGap * std::max(tick_s, usual_s)) {}

  // after_refused: samples between the previous one and this one were refused. after_lost: they did not
  // arrive.
  void Add(Sample sample, bool after_refused = false, bool after_lost = false) {
    samples_.push_back({std::move(sample), after_refused, after_lost});
  }

  // A tick and its neighbors. If a sample coincides with the tick, both neighbors are this sample. The
  // pointers are valid until the next call.
  struct Tick {
    int64_t number;
    const Sample* before;
    const Sample* behind;
    // Position of the tick from `before` (0) to `behind` (1).
    double share;
  };
  // Returns the next tick; nullopt until a sample at or after this tick has been added.
  std::optional<Tick> Next() {
    while (!samples_.empty()) {
      const Entry& behind = samples_.front();
      const double at = behind.sample.time_s - TimeOf(next_);
      if (at < -kOnSample) {  // the tick is later
        Pass();
        continue;
      }
      if (!before_ || at <= kOnSample) {
        if (!before_ || !is_broken()) {
          const Sample* on = &behind.sample;
          return Tick{next_++, on, on, 0};
        }
        ++next_;
        Break();
        continue;
      }
      const double apart = behind.sample.time_s - before_->time_s;
      if (apart > longest_s_ || is_broken()) {
        if (apart > longest_s_) ++gaps_;
        if (apart > longest_s_ && !is_broken() && !behind.after_lost) sparse_.Add(apart);
        // The tick at this sample, if there is one, is not missing.
        const auto reached = static_cast<int64_t>(std::ceil((behind.sample.time_s - kOnSample) / tick_s_));
        next_ = std::max(next_ + 1, reached);
        Break();
        continue;
      }
      return Tick{next_++, &*before_, &behind.sample, (TimeOf(next_ - 1) - before_->time_s) / apart};
    }
    return std::nullopt;
  }

  // Returns the number of the next tick that Next() returns, unless it is missing.
  int64_t next() const { return next_; }
  // Returns the number of pairs of neighboring samples that were too far apart.
  int gaps() const { return gaps_; }
  // The pairs among them between which no sample was refused or lost, with their shortest and longest time
  // apart in s.
  struct Sparse {
    int pairs = 0;
    double shortest_s = 0, longest_s = 0;

    void Add(double apart_s) {
      shortest_s = pairs == 0 ? apart_s : std::min(shortest_s, apart_s);
      longest_s = std::max(longest_s, apart_s);
      ++pairs;
    }
  };
  const Sparse& sparse() const { return sparse_; }
  // Returns true if a refused sample has not yet caused a missing tick.
  bool is_broken() const { return broken_ || (!samples_.empty() && samples_.front().after_refused); }

 private:
  struct Entry {
    Sample sample;
    bool after_refused;
    bool after_lost;
  };
  static constexpr double kGap = 3;
  // Tolerance in s: if a sample is this close to a tick, the tick uses it without interpolation. A source
  // rounds the times of its samples to microseconds.
  static constexpr double kOnSample = 0.501e-6;

  double TimeOf(int64_t tick) const { return static_cast<double>(tick) * tick_s_; }
  void Break() {
    broken_ = false;
    if (!samples_.empty()) samples_.front().after_refused = false;
  }
  void Pass() {
    broken_ = is_broken();
    before_ = std::move(samples_.front().sample);
    samples_.pop_front();
  }

  double tick_s_, longest_s_;
  std::deque<Entry> samples_;
  // The last sample before the next tick.
  std::optional<Sample> before_;
  bool broken_ = false;
  int64_t next_ = 0;
  int gaps_ = 0;
  Sparse sparse_;
};

}  // namespace evalbus::sim
