// Confidence intervals of means. The method depends on the number of values (for two samples, on the number
// of values of the smaller one):
//  - Below 20 values: Student's t (Student 1908, "The probable error of a mean", Biometrika 6; for two
// samples Welch 1947, "The generalization of 'Student's' problem", Biometrika 34), because the bootstrap's
// coverage is far below 95 % for such small samples.
//  - Up to 500 values: the bootstrap of Efron and Tibshirani 1993, "An introduction to the bootstrap",
// chapters 13 (percentile) and 14 (BCa: bias-corrected and accelerated).
//  - Above 500 values: the limit of BCa (Hall 1992, "The bootstrap and Edgeworth expansion", section 3.5),
// because resampling would take minutes for the same result.
// Resampling always uses the same random numbers, so the results are deterministic. docs/metrics.md lists the
// coverage of each method.
//
// There is no interval (NaN) for fewer than two values, or if all values are equal: such a sample does not
// show how much the values vary.
#pragma once

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "metrics/statistics/describe.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/ties.h"

namespace evalbus::metrics {

inline constexpr int kResamples = 10000;
inline constexpr Interval kNoInterval = {std::numeric_limits<double>::quiet_NaN(),
                                         std::numeric_limits<double>::quiet_NaN()};
// Smaller samples are not resampled; Student's t is used instead.
inline constexpr size_t kFewestToResample = 20;
// Larger samples are not resampled; the Edgeworth expansion is used instead. It differs from BCa by terms of
// order 1/n.
inline constexpr size_t kMaxToResample = 500;

// Draws indices 0 .. n-1 with replacement. The C++ standard fixes the engine's output.
class Resampler {
 public:
  template <class Use>
  void Draw(size_t n, const Use& use) {
    for (size_t i = 0; i < n; i += 2) {
      const uint64_t bits = engine_();
      use(static_cast<size_t>((bits >> 32) * n >> 32));
      if (i + 1 < n) use(static_cast<size_t>((bits & 0xFFFFFFFF) * n >> 32));
    }
  }
  double Mean(std::span<const double> x) {
    double sum = 0;
    Draw(x.size(), [&](size_t i) { sum += x[i]; });
    return sum / static_cast<double>(x.size());
  }

 private:
  std::mt19937_64 engine_{1993};
};

inline Interval PercentileInterval(std::vector<double> resamples) {
  std::sort(resamples.begin(), resamples.end());
  return {Quantile(resamples, kAlpha / 2), Quantile(resamples, 1 - kAlpha / 2)};
}

// Returns the BCa interval.
// estimate: mean, or difference of means, of the original sample.
// acceleration: one sixth of the skewness of the influence values.
// tie: resamples at most this far from the estimate count as equal to it, because they may differ only in the
// order of summation.
inline Interval BcaInterval(std::vector<double> resamples, double estimate, double acceleration, double tie) {
  std::sort(resamples.begin(), resamples.end());
  const auto below = std::lower_bound(resamples.begin(), resamples.end(), estimate - tie);
  const auto above = std::upper_bound(resamples.begin(), resamples.end(), estimate + tie);
  // Half of the resamples that equal the estimate count as smaller.
  const double smaller =
      static_cast<double>((below - resamples.begin()) + (above - resamples.begin())) / 2 / resamples.size();
  if (smaller <= 0 || smaller >= 1)
    return {Quantile(resamples, kAlpha / 2), Quantile(resamples, 1 - kAlpha / 2)};
  const boost::math::normal_distribution<> normal;
  const double bias = quantile(normal, smaller);
  const auto corrected = [&](double z) {
    const double shifted = bias + z;
    return Quantile(resamples, cdf(normal, bias + shifted / (1 - acceleration * shifted)));
  };
  return {corrected(-kNormal975), corrected(kNormal975)};
}

// Sums of squares and cubes of the scaled deviations from the mean; used for the acceleration.
struct Moments {
  double squares = 0, cubes = 0;
  void Add(std::span<const double> x, double scale) {
    const double mean = Mean(x);
    for (const double value : x) {
      const double d = (value - mean) * scale;
      squares += d * d;
      cubes += d * d * d;
    }
  }
  double acceleration() const { return cubes / (6 * std::pow(squares, 1.5)); }
};

// Returns the interval of a mean with this standard error. acceleration: one sixth of the skewness / sqrt(n).
inline Interval EdgeworthInterval(double mean, double standard_error, double acceleration) {
  const auto end = [&](double z) { return mean + standard_error * (z + acceleration * (2 * z * z + 1)); };
  return {end(-kNormal975), end(kNormal975)};
}

// Returns the interval of an estimate with this standard error.
inline Interval StudentInterval(double estimate, double standard_error, double degrees_of_freedom) {
  const double t = quantile(boost::math::students_t_distribution<>(degrees_of_freedom), 1 - kAlpha / 2);
  return {estimate - t * standard_error, estimate + t * standard_error};
}

inline bool AreAllEqual(std::span<const double> x, double tie) {
  const auto [least, most] = std::minmax_element(x.begin(), x.end());
  return *most - *least <= tie;
}

// Returns the interval of the mean. For paired data, pass the differences.
inline Interval IntervalOfMean(std::span<const double> x) {
  if (x.size() < 2) return kNoInterval;
  const double tie = kTie * LargestMagnitude(x);
  if (AreAllEqual(x, tie)) return kNoInterval;
  const auto n = static_cast<double>(x.size());
  if (x.size() < kFewestToResample) {
    return StudentInterval(Mean(x), StandardDeviation(x) / std::sqrt(n), n - 1);
  }
  if (x.size() > kMaxToResample) {
    Moments moments;
    moments.Add(x, 1 / static_cast<double>(x.size()));
    return EdgeworthInterval(Mean(x), std::sqrt(moments.squares), moments.acceleration());
  }
  Resampler resampler;
  std::vector<double> means(kResamples);
  for (double& mean : means) mean = resampler.Mean(x);
  Moments moments;
  moments.Add(x, 1);
  return BcaInterval(std::move(means), Mean(x), moments.acceleration(), tie);
}

// Returns the interval of mean(a) - mean(b), for independent samples.
inline Interval IntervalOfDifference(std::span<const double> a, std::span<const double> b) {
  if (a.size() < 2 || b.size() < 2) return kNoInterval;
  const double tie = kTie * std::max(LargestMagnitude(a), LargestMagnitude(b));
  if (AreAllEqual(a, tie) && AreAllEqual(b, tie)) return kNoInterval;
  if (std::min(a.size(), b.size()) < kFewestToResample) {
    const auto n_a = static_cast<double>(a.size()), n_b = static_cast<double>(b.size());
    // Squared standard errors.
    const double error_a = std::pow(StandardDeviation(a), 2) / n_a,
                 error_b = std::pow(StandardDeviation(b), 2) / n_b;
    const double degrees_of_freedom =
        std::pow(error_a + error_b, 2) / (error_a * error_a / (n_a - 1) + error_b * error_b / (n_b - 1));
    return StudentInterval(Mean(a) - Mean(b), std::sqrt(error_a + error_b), degrees_of_freedom);
  }
  Moments moments;
  moments.Add(a, 1 / static_cast<double>(a.size()));
  moments.Add(b, -1 / static_cast<double>(b.size()));
  if (std::min(a.size(), b.size()) > kMaxToResample) {
    return EdgeworthInterval(Mean(a) - Mean(b), std::sqrt(moments.squares), moments.acceleration());
  }
  Resampler resampler;
  std::vector<double> differences(kResamples);
  for (double& difference : differences) {
    const double mean_a = resampler.Mean(a);
    difference = mean_a - resampler.Mean(b);
  }
  return BcaInterval(std::move(differences), Mean(a) - Mean(b), moments.acceleration(), tie);
}

// Returns the interval of mean(a) / mean(b) for pairs (equal sizes) of nonnegative values: Student's t,
// percentile bootstrap or Edgeworth expansion, by the number of pairs. There is no interval if the mean of b
// is zero, or if the sum of b is zero in some resample.
inline Interval IntervalOfRatio(std::span<const double> a, std::span<const double> b) {
  if (a.size() < 2 || a.size() != b.size()) return kNoInterval;
  const double mean_b = Mean(b);
  if (mean_b <= 0) return kNoInterval;
  const double ratio = Mean(a) / mean_b;
  // Influence of each pair on the ratio.
  std::vector<double> influence(a.size());
  for (size_t i = 0; i < a.size(); ++i) influence[i] = (a[i] - ratio * b[i]) / mean_b;
  if (AreAllEqual(influence, kTie * std::max(1.0, ratio))) return kNoInterval;
  if (a.size() < kFewestToResample) {
    const auto n = static_cast<double>(a.size());
    return StudentInterval(ratio, StandardDeviation(influence) / std::sqrt(n), n - 1);
  }
  if (a.size() > kMaxToResample) {
    Moments moments;
    moments.Add(influence, 1 / static_cast<double>(a.size()));
    return EdgeworthInterval(ratio, std::sqrt(moments.squares), moments.acceleration());
  }
  Resampler resampler;
  std::vector<double> ratios(kResamples);
  for (double& resampled : ratios) {
    double sum_a = 0, sum_b = 0;
    resampler.Draw(a.size(), [&](size_t i) {
      sum_a += a[i];
      sum_b += b[i];
    });
    if (sum_b <= 0) return kNoInterval;
    resampled = sum_a / sum_b;
  }
  return PercentileInterval(std::move(ratios));
}

}  // namespace evalbus::metrics
