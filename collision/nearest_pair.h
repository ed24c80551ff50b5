// Finds the nearest of many pairs of moving bodies without measuring pairs that cannot be the nearest. For
// each pair, it stores a lower bound of the distance, which decreases by the motion of the two bodies. Pure.
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

  // pairs: pairs of bodies, which are numbered from 0 to num_bodies - 1.
  NearestPair(std::vector<std::pair<int, int>> pairs, int num_bodies)
      : pairs_(std::move(pairs)), travel_(num_bodies), bound_(pairs_.size(), -kInfinity) {
    queue_.reserve(pairs_.size());
  }

  // distance: upper bound of the motion of any point of the body since the last call, m.
  void Moved(int body, double distance) { travel_[body] += distance; }
  // Discards all bounds. Must be called if a body has moved by an unknown distance.
  void Forget() { bound_.assign(bound_.size(), -kInfinity); }

  // Returns the nearest pair and its distance if the distance is less than `below`. Earlier queries only
  // affect the speed. gap(pair): positive lower bound of a pair's distance, or 0 if there is none.
  // measure(pair): the distance, negative if the two bodies overlap. Among equally near pairs, the pair with
  // the smallest gap takes precedence, then the first pair.
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
  // Tolerance for the errors of measured distances and of summed motions, m. FCL stops at 1e-9, and a sum of
  // 1e6 m is accurate to 1e-10.
  static constexpr double kTolerance = 1e-6;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double Travel(int pair) const { return travel_[pairs_[pair].first] + travel_[pairs_[pair].second]; }

  std::vector<std::pair<int, int>> pairs_;
  // Total motion of each body, m.
  std::vector<double> travel_;
  // Bound for each pair: the pair's distance is at least this bound minus the travel of its bodies.
  std::vector<double> bound_;
  std::vector<std::pair<double, int>> queue_;
};

}  // namespace evalbus::collision
