#include "metrics/statistics/range_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>

namespace evalbus::metrics::range_scan_test {

using testing::ElementsAre;

TEST(RangeScan, BinsHaveAboutEqualCountsAndShareEqualValues) {
  EXPECT_THAT(RankBins(std::vector<double>{6, 5, 4, 3, 2, 1}, 3), ElementsAre(2, 2, 1, 1, 0, 0));
  // If there are as many different values as bins, each value has its own bin, however rare it is.
  EXPECT_THAT(RankBins(std::vector<double>{0, 1, 1, 1, 1}, 2), ElementsAre(0, 1, 1, 1, 1));
  EXPECT_THAT(RankBins(std::vector<double>{0, 1, 2, 2, 2, 2, 2, 2}, 2), ElementsAre(0, 0, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(RankBins(std::vector<double>{7, 7}, 5), ElementsAre(0, 0));
}

TEST(RangeScan, SmallRunsHaveTenBins) {
  EXPECT_EQ(RangeScan::BinsFor(1), 2);
  EXPECT_EQ(RangeScan::BinsFor(6), 6);
  EXPECT_EQ(RangeScan::BinsFor(16), 10);
  EXPECT_EQ(RangeScan::BinsFor(54), 10);
  EXPECT_EQ(RangeScan::BinsFor(60), 12);
  EXPECT_EQ(RangeScan::BinsFor(1000), 20);
}

// Few of the C(16, 6) = 8008 placements of six successes separate them from the failures by a range: 11 have
// the successes side by side, and 5 more have them at both ends. With three bins, p was 0.054.
TEST(RangeScan, FindsAMiddleRangeInASmallRun) {
  const std::string outcomes = "0000000111111000";
  std::vector<double> values(outcomes.size());
  std::iota(values.begin(), values.end(), 0.0);
  const std::vector<int> bin_of = RankBins(values, RangeScan::BinsFor(values.size()));
  std::vector<RateBin> bins(10);
  for (size_t i = 0; i < values.size(); ++i) {
    RateBin& bin = bins.at(static_cast<size_t>(bin_of[i]));
    ++bin.trials;
    bin.successes += outcomes[i] == '1';
  }
  EXPECT_LT(RangeScan().P(bins), 0.005);
}

TEST(RangeScan, FindsTheRangeThatDiffersMost) {
  const std::vector<RateBin> bins = {{5, 5}, {5, 4}, {5, 0}, {5, 1}, {5, 5}};
  const BinRange range = FindRange(bins);
  EXPECT_EQ(range.first, 2);
  EXPECT_EQ(range.last, 3);
}

// Returns the log likelihood of a bin's outcomes at the bin's own rate.
double LogLikelihood(int trials, int successes) {
  double sum = 0;
  for (const int k : {successes, trials - successes})
    if (k > 0) sum += k * std::log(static_cast<double>(k) / trials);
  return sum;
}

// Returns the p-value over all placements of the successes on nine trials in three bins, computed from the
// definition.
double Enumerated(const std::vector<RateBin>& observed) {
  constexpr int kTrials = 9;
  struct Values {
    double scan, trend;
  };
  const auto values = [](unsigned placement) {
    Values result{-std::numeric_limits<double>::infinity(), 0};
    const auto count = [&](int from, int to) {
      int successes = 0;
      for (int i = from; i < to; ++i) successes += static_cast<int>(placement >> i & 1);
      return successes;
    };
    const int all = count(0, kTrials);
    for (int from = 0; from < kTrials; from += 3) {
      for (int to = from + 3; to <= kTrials; to += 3) {
        if (to - from == kTrials) continue;
        const int inside = count(from, to);
        result.scan = std::max(
            result.scan, LogLikelihood(to - from, inside) + LogLikelihood(kTrials - to + from, all - inside));
      }
    }
    result.trend = std::abs(count(6, 9) - count(0, 3));
    return result;
  };
  unsigned mine = 0;
  int successes = 0;
  for (size_t bin = 0; bin < 3; ++bin) {
    successes += observed[bin].successes;
    for (int i = 0; i < observed[bin].successes; ++i) mine |= 1u << (3 * bin + static_cast<size_t>(i));
  }
  std::vector<Values> all;
  for (unsigned placement = 0; placement < 1u << kTrials; ++placement)
    if (std::popcount(placement) == successes) all.push_back(values(placement));
  const auto tail = [&](const Values& value) {
    const auto scans =
        std::ranges::count_if(all, [&](const Values& x) { return x.scan >= value.scan - 1e-9; });
    const auto trends =
        std::ranges::count_if(all, [&](const Values& x) { return x.trend >= value.trend - 1e-9; });
    return std::min(scans, trends);
  };
  const auto limit = tail(values(mine));
  const auto more = std::ranges::count_if(all, [&](const Values& x) { return tail(x) <= limit; });
  return static_cast<double>(more) / static_cast<double>(all.size());
}

TEST(RangeScan, PIsThatOfAllPermutations) {
  RangeScan scan;
  for (const std::vector<RateBin>& bins :
       {std::vector<RateBin>{{3, 3}, {3, 1}, {3, 0}}, {{3, 0}, {3, 3}, {3, 1}}, {{3, 2}, {3, 1}, {3, 1}}}) {
    const double exact = Enumerated(bins);
    // The tolerance is four standard errors of 20,000 permutations.
    EXPECT_NEAR(scan.P(bins), exact, 4 * std::sqrt(exact * (1 - exact) / RangeScan::kPermutations));
  }
}

// Returns the p-value of the likelihood ratio over all tables with the margins of `observed`, each with its
// hypergeometric probability (Freeman and Halton 1951).
double EnumeratedUnordered(const std::vector<RateBin>& observed) {
  int successes = 0;
  for (const RateBin& bin : observed) successes += bin.successes;
  const auto log_choose = [](int n, int k) {
    return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
  };
  const auto ratio = [](const std::vector<RateBin>& bins) {
    double sum = 0;
    for (const RateBin& bin : bins) sum += LogLikelihood(bin.trials, bin.successes);
    return sum;
  };
  const double mine = ratio(observed);
  double total = 0, as_uneven = 0;
  std::vector<RateBin> table = observed;
  const std::function<void(size_t, int)> visit = [&](size_t bin, int left) {
    if (bin == table.size()) {
      if (left != 0) return;
      double log_weight = 0;
      for (const RateBin& one : table) log_weight += log_choose(one.trials, one.successes);
      total += std::exp(log_weight);
      if (ratio(table) >= mine - 1e-9) as_uneven += std::exp(log_weight);
      return;
    }
    for (int k = 0; k <= std::min(left, table[bin].trials); ++k) {
      table[bin].successes = k;
      visit(bin + 1, left - k);
    }
  };
  visit(0, successes);
  return as_uneven / total;
}

TEST(RangeScan, UnorderedPIsThatOfAllTables) {
  for (const std::vector<RateBin>& bins : {std::vector<RateBin>{{8, 8}, {9, 4}, {7, 6}},
                                           {{10, 9}, {10, 2}},
                                           {{5, 1}, {12, 11}, {3, 3}, {6, 4}},
                                           {{6, 3}, {6, 3}, {6, 4}}}) {
    const double exact = EnumeratedUnordered(bins);
    // The tolerance is four standard errors of 20,000 permutations.
    EXPECT_NEAR(RangeScan::UnorderedP(bins), exact,
                4 * std::sqrt(exact * (1 - exact) / RangeScan::kPermutations) + 1e-4);
    // The order does not matter, except for the random numbers.
    const std::vector<RateBin> reversed(bins.rbegin(), bins.rend());
    EXPECT_NEAR(RangeScan::UnorderedP(reversed), exact,
                4 * std::sqrt(exact * (1 - exact) / RangeScan::kPermutations) + 1e-4);
  }
  EXPECT_EQ(RangeScan::UnorderedP(std::vector<RateBin>{{5, 5}, {5, 5}}), 1);
}

TEST(RangeScan, TheLowGroupIsTheOneThatDiffersMost) {
  EXPECT_THAT(FindLowGroup(std::vector<RateBin>{{10, 9}, {10, 2}, {10, 10}, {10, 1}}),
              ElementsAre(false, true, false, true));
  EXPECT_THAT(FindLowGroup(std::vector<RateBin>{{10, 1}, {10, 9}}), ElementsAre(true, false));
}

TEST(RangeScan, PDoesNotDependOnEarlierTests) {
  const std::vector<RateBin> bins = {{10, 9}, {10, 5}, {10, 7}};
  RangeScan first, second;
  second.P(std::vector<RateBin>{{10, 2}, {10, 1}, {10, 7}});
  EXPECT_EQ(first.P(bins), second.P(bins));
}

TEST(RangeScan, WithoutFailuresOrSecondBinPIsOne) {
  RangeScan scan;
  EXPECT_EQ(scan.P(std::vector<RateBin>{{5, 5}, {5, 5}}), 1);
  EXPECT_EQ(scan.P(std::vector<RateBin>{{5, 0}, {5, 0}}), 1);
  EXPECT_EQ(scan.P(std::vector<RateBin>{{5, 3}}), 1);
}

}  // namespace evalbus::metrics::range_scan_test
