// Test for equality of two policies on paired data that may be evaluated several times while pairs are added
// ("looks"). The first look that decides ends the comparison.
//
// Looks: a pair is discordant if one policy is better. Let q be the probability that policy a is the better
// policy in a discordant pair. If the policies are equal, q = 1/2. Take the likelihood of the discordant
// pairs, averaged over q (weights: Jeffreys' prior, as in Krichevsky and Trofimov 1981), and divide it by
// their likelihood for q = 1/2. If the policies are equal, this ratio is a martingale that starts at 1 (an
// e-process), and the probability that it ever reaches 1 / alpha is at most alpha (Ville 1939). With these
// weights, few pairs suffice to decide clear differences. The mean of several e-processes is an e-process
// (Vovk and Wang 2021, "E-values: Calibration, combination and applications", Annals of Statistics 49), so
// success and progress can be tested together.
//
// Last look: an exact McNemar test of success. It is evaluated only once, after a number of pairs that was
// fixed beforehand. The looks use the share kLooksShare of alpha, and this test uses the rest. If the
// policies are equal, the looks and this test together report a difference with probability at most alpha
// (Bonferroni).
//
// STEP (Snyder et al. 2025, "Is Your Imitation Learning Policy Better than Mine? Policy Comparison with
// Near-Optimal Stopping") needs fewer pairs if only success is tested. The method of arXiv 2603.13616 also
// tests more than success. The test used here needs only a formula. docs/plans.md lists its error rates and
// the number of pairs that it needs.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "metrics/statistics/exact_tests.h"

namespace evalbus::metrics {

// Share of alpha for the looks. A smaller share would find fewer clear differences early; a larger share
// would miss more small differences at the last look.
inline constexpr double kLooksShare = 0.4;

// Numbers of pairs in which only a, or only b, was better.
struct Wins {
  int a = 0, b = 0;
};

// Returns the evidence against equality (an e-value): 2^n B(a + 1/2, b + 1/2) / B(1/2, 1/2), n = a + b. If
// both policies are equal, its expected value is at most 1 at any time.
inline double EvidenceOf(const Wins& wins) {
  const double n = wins.a + wins.b;
  return std::exp(n * std::numbers::ln2 + std::lgamma(wins.a + 0.5) + std::lgamma(wins.b + 0.5) -
                  std::lgamma(n + 1)) /
         std::numbers::pi;
}

// Returns the p-value of a look. The comparison uses the smallest p-value of its looks so far. success: pairs
// in which only one of the two policies succeeded. progress: pairs in which one policy was ahead by success,
// stages or time (docs/plans.md); nullopt if success alone is tested. is_last: whether this is the last look,
// after the largest number of pairs.
inline double SequentialP(const Wins& success, const std::optional<Wins>& progress, bool is_last) {
  double evidence = EvidenceOf(success);
  if (progress) evidence = (evidence + EvidenceOf(*progress)) / 2;
  double p = 1 / (evidence * kLooksShare);
  if (is_last) p = std::min(p, McNemarTest(success.a, success.b) / (1 - kLooksShare));
  return std::min(1.0, p);
}

}  // namespace evalbus::metrics
