// Test for equality of two policies on paired data that may be evaluated at many looks, of which the first
// that decides ends the comparison.
//
// Looks: if the two policies are equal, each wins half of the pairs in which one of them is better. The
// average of the likelihood over all other shares, divided by the likelihood of one half, is then a
// martingale that starts at 1 (an e-process). It ever reaches 1 / alpha with probability at most alpha (Ville
// 1939). The average is that of Krichevsky and Trofimov 1981 (Jeffreys' prior), which decides clear
// differences after few pairs. The mean of several e-processes is an e-process (Vovk and Wang 2021,
// "E-values: Calibration, combination and applications", Annals of Statistics 49), so success and progress
// can be tested together.
//
// Last look: an exact McNemar test of success. It is evaluated only once, after a number of pairs that was
// fixed beforehand. The looks have the share kLooksShare of alpha, this test has the rest: by Bonferroni both
// together err with probability at most alpha.
//
// Snyder et al. 2025, "Is Your Imitation Learning Policy Better than Mine? Policy Comparison with
// Near-Optimal Stopping" (STEP), need fewer pairs of success alone; arXiv 2603.13616 also tests more than
// success. This test needs only a formula. docs/plans.md has its errors and what it costs.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "metrics/statistics/mcnemar.h"

namespace evalbus::metrics {

// Share of alpha for the looks. Less would find fewer clear differences early, more would miss more of the
// small ones at the last look.
inline constexpr double kLooksShare = 0.4;

// Numbers of pairs in which only a, or only b, was better.
struct Wins {
  int a = 0, b = 0;
};

// Evidence against equality (an e-value): 2^n B(a + 1/2, b + 1/2) / B(1/2, 1/2), n = a + b. At most 1 on
// average if both are equal, at any time.
inline double EvidenceOf(const Wins& wins) {
  const double n = wins.a + wins.b;
  return std::exp(n * std::numbers::ln2 + std::lgamma(wins.a + 0.5) + std::lgamma(wins.b + 0.5) -
                  std::lgamma(n + 1)) /
         std::numbers::pi;
}

// p-value of a look; the smallest one so far counts. success: pairs in which only one of the two succeeded.
// progress: pairs in which one was ahead in a wider sense; nothing if success alone is tested. is_last:
// whether this is the last look, after the largest number of pairs.
inline double SequentialP(const Wins& success, const std::optional<Wins>& progress, bool is_last) {
  double evidence = EvidenceOf(success);
  if (progress) evidence = (evidence + EvidenceOf(*progress)) / 2;
  double p = 1 / (evidence * kLooksShare);
  if (is_last) p = std::min(p, McNemarTest(success.a, success.b) / (1 - kLooksShare));
  return std::min(1.0, p);
}

}  // namespace evalbus::metrics
