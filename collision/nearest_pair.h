// The nearest of many pairs of things that move, without measuring pairs that cannot be it: each pair
// remembers how near it was at least when it was looked at last, and how far its two things have moved since.
// Pure.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace evalbus::collision {

class NearestPair {
 public:
  struct Found {
    int pair;
    double distance;  // m
  };

  // Pairs of things, which are 0 to num_things - 1.
  NearestPair(std::vector<std::pair<int, int>> pairs, int num_things)
      : pairs_(std::move(pairs)), travel_(num_things), bound_(pairs_.size(), -kInfinity) {
    queue_.reserve(pairs_.size());
  }

  // No point of the thing has moved further (m) than this since the last call.
  void Moved(int thing, double distance) { travel_[thing] += distance; }
  // A thing has moved nobody knows how far.
  void Forget() { bound_.assign(bound_.size(), -kInfinity); }

  // The nearest pair and its distance where that is less than `below`. What was asked before makes it faster
  // and changes nothing else. gap(pair): a lower bound of a pair's distance where that is above 0, else 0;
  // measure(pair): the distance, negative where the two overlap. Of equally near pairs that of the smallest
  // gap, then the first.
  template <class Gap, class Measure>
  std::optional<Found> Find(double below, const Gap& gap, const Measure& measure) {
    queue_.clear();
    for (int pair = 0; pair < static_cast<int>(pairs_.size()); ++pair) {
      if (bound_[pair] - Travel(pair) >= below) continue;
      const double least = gap(pair);
      const double bound = least > 0 ? least - kTolerance : -kInfinity;
      bound_[pair] = bound + Travel(pair);
      if (bound < below) queue_.emplace_back(least, pair);
    }
    std::sort(queue_.begin(), queue_.end());
    std::optional<Found> nearest;
    double limit = below;
    for (const auto& [least, pair] : queue_) {
      if (least > 0 && least - kTolerance > limit) break;
      const double distance = measure(pair);
      bound_[pair] = distance - kTolerance + Travel(pair);
      if (distance >= limit) continue;
      limit = distance;
      nearest = {pair, distance};
    }
    return nearest;
  }

 private:
  // For what measuring and adding up leave open, m: FCL stops at 1e-9, and a sum of 1e6 m is good to 1e-10.
  static constexpr double kTolerance = 1e-6;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double Travel(int pair) const { return travel_[pairs_[pair].first] + travel_[pairs_[pair].second]; }

  std::vector<std::pair<int, int>> pairs_;
  // Since the beginning, by thing.
  std::vector<double> travel_;
  // By pair: its distance is at least this less its travel.
  std::vector<double> bound_;
  std::vector<std::pair<double, int>> queue_;
};

}  // namespace evalbus::collision
