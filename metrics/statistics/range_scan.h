// Permutation test of whether a success rate depends on a number that was drawn at random. It combines two
// statistics over bins of equal numbers of trials: the largest log likelihood ratio over all ranges of bins
// (Kulldorff 1997, "A spatial scan statistic", Communications in Statistics 26; Bernoulli model), which also
// finds effects that are not monotone, and the rank-sum of Mann and Whitney 1947, which finds slow trends.
//
// For values drawn from a list without an order, the statistic is the log likelihood ratio of one rate per
// bin against one common rate (Wilks 1938).
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

namespace evalbus::metrics {

// Assigns each value to one of at most `most` bins with about equal numbers of values, in ascending order;
// equal values share a bin. There are at least two bins if there are two different values and most >= 2; if
// there are at most `most` different values, each has a bin. Returns indices without gaps, from 0.
std::vector<int> RankBins(std::span<const double> values, int most);

// Number of trials in a bin, and number of successes among them.
struct RateBin {
  int trials = 0, successes = 0;
};

// A range of bins, both ends included.
struct BinRange {
  int first = 0, last = 0;
};
// Returns the range of bins that differs most from the other bins. Requires at least two bins.
BinRange FindRange(std::span<const RateBin> bins);

// For bins without an order, at least two. Divides the bins by their rates into the two groups that differ
// most. Returns, for each bin, whether it belongs to the group with the lower rates.
std::vector<bool> FindLowGroup(std::span<const RateBin> bins);

// Computes p-values. Every null distribution is drawn with the same random numbers, so that equal bins have
// equal p-values, independent of earlier tests.
class RangeScan {
 public:
  static constexpr int kMaxBins = 20;
  // Small runs have up to this number of bins, so that a range in the middle can be found in them. The
  // p-value is exact for any bins, because the bins do not depend on the outcomes.
  static constexpr int kMinBins = 10;
  // If there are more than kMinBins bins, they have at least this number of values on average.
  static constexpr int kTrialsPerBin = 5;
  // Number of permutations; no p-value is below 1 / (kPermutations + 1).
  static constexpr int kPermutations = 20'000;

  // Returns the number of bins to use for this number of trials, at least 2.
  static int BinsFor(size_t trials);

  // Returns the p-value: the probability of bins that are at least as uneven if all trials have the same
  // rate. It is 1 if there are fewer than two bins, no success or no failure.
  double P(std::span<const RateBin> bins);
  // Returns the p-value for bins without an order.
  static double UnorderedP(std::span<const RateBin> bins);

 private:
  // Values of the statistics in the permutations, each in ascending order.
  struct Null {
    std::vector<double> scan, trend, smallest_tail;
  };
  const Null& NullOf(std::span<const RateBin> bins);

  // Null distributions by the number of trials in each bin and the total number of successes.
  std::map<std::pair<std::vector<int>, int>, Null> nulls_;
};

}  // namespace evalbus::metrics
