// Which control ticks lie between somebody else's samples, and what is missing. The rule, of live sources and
// of files alike: tick k is the moment k control periods after the first sample, and lies between two
// neighbors, the last sample before it and the first one at or behind it. Where these are further apart than
// three times the usual distance, or than three ticks, the ticks between them are missing. So are those on
// the way to a sample before which one was refused, or, where there is none, the next ones. Pure.
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
  // tick_s, usual_s: control period, and time between two samples as it should be.
  SampleTicks(double tick_s, double usual_s)
      : tick_s_(tick_s), longest_s_(kGap * std::max(tick_s, usual_s)) {}

  // after_refused: what was measured since the sample before is not known.
  void Add(Sample sample, bool after_refused = false) {
    samples_.push_back({std::move(sample), after_refused});
  }

  // A tick and its neighbors, which are one where it is the sample. They are good until the next call.
  struct Tick {
    int64_t number;
    const Sample* before;
    const Sample* behind;
    // How far it is from one to the other, 0 to 1.
    double share;
  };
  // The next one; nothing while the sample behind it is not there.
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
        // The sample itself may be on a tick; after a gap that one is there.
        const auto reached = static_cast<int64_t>(std::ceil((behind.sample.time_s - kOnSample) / tick_s_));
        next_ = std::max(next_ + 1, reached);
        Break();
        continue;
      }
      return Tick{next_++, &*before_, &behind.sample, (TimeOf(next_ - 1) - before_->time_s) / apart};
    }
    return std::nullopt;
  }

  // Places at which samples are too far apart.
  int gaps() const { return gaps_; }
  // What was refused has not cost a tick yet.
  bool is_broken() const { return broken_ || (!samples_.empty() && samples_.front().after_refused); }

 private:
  struct Entry {
    Sample sample;
    bool after_refused;
  };
  static constexpr double kGap = 3;
  // Within this time (s) a tick uses the sample itself, without interpolation: a source rounds the times of
  // its samples to a microsecond.
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
  // The last one before the next tick.
  std::optional<Sample> before_;
  bool broken_ = false;
  int64_t next_ = 0;
  int gaps_ = 0;
};

}  // namespace evalbus::sim
