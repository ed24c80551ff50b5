#include "metrics/statistics/range_scan.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "base/random.h"

namespace evalbus::metrics {
namespace {

// Seed of the permutations.
constexpr int64_t kScanSeed = 1997;
// Statistics that differ by less than rounding are equal.
constexpr double kEqual = 1e-9;

// Evaluates the statistics for a fixed total number of trials and successes.
class Statistics {
 public:
  explicit Statistics(std::span<const RateBin> bins) {
    for (const RateBin& bin : bins) {
      // Twice the mean rank of the bin's trials. The loop below subtracts the middle of all ranks.
      middle_.push_back(2 * trials_ + bin.trials);
      trials_ += bin.trials;
      successes_ += bin.successes;
    }
    for (double& middle : middle_) middle -= trials_;
    for (int i = 0; i <= trials_; ++i) log_.push_back(i == 0 ? 0 : i * std::log(i));
  }

  int trials() const { return trials_; }
  int successes() const { return successes_; }

  // Returns the log likelihood ratio of a range with its own rate against one common rate.
  double Ratio(int trials, int successes) const {
    return LogLikelihood(trials, successes) + LogLikelihood(trials_ - trials, successes_ - successes) -
           LogLikelihood(trials_, successes_);
  }

  // Returns the log likelihood ratio of one rate per bin against one common rate.
  double RatioOfAll(std::span<const RateBin> bins) const {
    double ratio = -LogLikelihood(trials_, successes_);
    for (const RateBin& bin : bins) ratio += LogLikelihood(bin.trials, bin.successes);
    return ratio;
  }

  // Returns the largest ratio of any range of bins.
  double Scan(std::span<const RateBin> bins, BinRange* range = nullptr) const {
    double largest = -1;
    for (size_t first = 0; first < bins.size(); ++first) {
      int trials = 0, successes = 0;
      for (size_t last = first; last < bins.size(); ++last) {
        trials += bins[last].trials;
        successes += bins[last].successes;
        if (trials == trials_) break;
        const double ratio = Ratio(trials, successes);
        if (ratio <= largest + kEqual) continue;
        largest = ratio;
        if (range) *range = {static_cast<int>(first), static_cast<int>(last)};
      }
    }
    return largest;
  }

  // Returns the distance of the rank sum of the successes from its expected value.
  double Trend(std::span<const RateBin> bins) const {
    double sum = 0;
    for (size_t i = 0; i < bins.size(); ++i) sum += bins[i].successes * middle_[i];
    return std::abs(sum);
  }

 private:
  // Returns the log likelihood of k successes in n trials at their own rate.
  double LogLikelihood(int n, int k) const { return log_[k] + log_[n - k] - log_[n]; }

  int trials_ = 0, successes_ = 0;
  std::vector<double> middle_;
  std::vector<double> log_;  // log_[i] = i log(i)
};

// Calls visit(bins) for kPermutations random assignments of the successes to the trials.
template <class Visit>
void VisitPermutations(std::span<const RateBin> bins, const Statistics& statistics, const Visit& visit) {
  std::vector<int> bin_of;
  for (size_t i = 0; i < bins.size(); ++i)
    bin_of.insert(bin_of.end(), static_cast<size_t>(bins[i].trials), static_cast<int>(i));
  // Draws the positions of the rarer outcome: successes or failures.
  const int total = statistics.trials(), successes = statistics.successes();
  const bool draws_failures = 2 * successes > total;
  const int draws = draws_failures ? total - successes : successes;
  Random random(kScanSeed, 0);
  std::vector<RateBin> permuted(bins.begin(), bins.end());
  for (int permutation = 0; permutation < RangeScan::kPermutations; ++permutation) {
    for (RateBin& bin : permuted) bin.successes = draws_failures ? bin.trials : 0;
    for (int i = 0; i < draws; ++i) {
      std::swap(bin_of[static_cast<size_t>(i)], bin_of[static_cast<size_t>(i + random.Index(total - i))]);
      permuted[static_cast<size_t>(bin_of[static_cast<size_t>(i)])].successes += draws_failures ? -1 : 1;
    }
    visit(permuted);
  }
}

// Returns whether there is anything to test: at least two bins, at least one success and at least one
// failure.
bool CanDiffer(std::span<const RateBin> bins, const Statistics& statistics) {
  return bins.size() >= 2 && statistics.successes() > 0 && statistics.successes() < statistics.trials();
}

// Returns the number of values that are at least `value`, up to rounding. `values` must be ascending.
double CountFrom(const std::vector<double>& values, double value) {
  return static_cast<double>(values.end() - std::ranges::lower_bound(values, value - kEqual));
}

}  // namespace

std::vector<int> RankBins(std::span<const double> values, int most) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return values[i]; });
  const std::set<double> distinct(values.begin(), values.end());
  const bool has_few = distinct.size() <= static_cast<size_t>(most);
  std::vector<int> bins(values.size());
  int bin = -1;
  size_t quantile = 0;
  for (size_t first = 0, end = 0; first < order.size(); first = end) {
    while (end < order.size() && values[order[end]] == values[order[first]]) ++end;
    // Bin that contains the mean rank of this group of equal values, if ranks are divided into `most` bins.
    const size_t now = (first + end - 1) * static_cast<size_t>(most) / (2 * order.size());
    if (bin < 0 || now > quantile || has_few) {
      ++bin;
      quantile = now;
    }
    for (size_t i = first; i < end; ++i) bins[order[i]] = bin;
  }
  return bins;
}

BinRange FindRange(std::span<const RateBin> bins) {
  BinRange range;
  Statistics(bins).Scan(bins, &range);
  return range;
}

std::vector<bool> FindLowGroup(std::span<const RateBin> bins) {
  const Statistics statistics(bins);
  std::vector<size_t> order(bins.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {},
                           [&](size_t i) { return static_cast<double>(bins[i].successes) / bins[i].trials; });
  double largest = -1;
  size_t size = 0;
  int trials = 0, successes = 0;
  for (size_t i = 0; i + 1 < order.size(); ++i) {
    trials += bins[order[i]].trials;
    successes += bins[order[i]].successes;
    const double ratio = statistics.Ratio(trials, successes);
    if (ratio <= largest + kEqual) continue;
    largest = ratio;
    size = i + 1;
  }
  std::vector<bool> is_low(bins.size());
  for (size_t i = 0; i < size; ++i) is_low[order[i]] = true;
  return is_low;
}

int RangeScan::BinsFor(size_t trials) {
  const auto count = static_cast<int>(trials);
  return std::clamp(std::max(count / kTrialsPerBin, std::min(count, kMinBins)), 2, kMaxBins);
}

const RangeScan::Null& RangeScan::NullOf(std::span<const RateBin> bins) {
  const Statistics statistics(bins);
  std::vector<int> trials;
  for (const RateBin& bin : bins) trials.push_back(bin.trials);
  const auto [entry, is_new] = nulls_.try_emplace({trials, statistics.successes()});
  Null& null = entry->second;
  if (!is_new) return null;
  std::vector<std::pair<double, double>> drawn;
  VisitPermutations(bins, statistics, [&](std::span<const RateBin> permuted) {
    const auto& [scan, trend] = drawn.emplace_back(statistics.Scan(permuted), statistics.Trend(permuted));
    null.scan.push_back(scan);
    null.trend.push_back(trend);
  });
  std::ranges::sort(null.scan);
  std::ranges::sort(null.trend);
  for (const auto& [scan, trend] : drawn)
    null.smallest_tail.push_back(std::min(CountFrom(null.scan, scan), CountFrom(null.trend, trend)));
  std::ranges::sort(null.smallest_tail);
  return null;
}

double RangeScan::P(std::span<const RateBin> bins) {
  const Statistics statistics(bins);
  if (!CanDiffer(bins, statistics)) return 1;
  const Null& null = NullOf(bins);
  // The observed bins count as one more permutation.
  const double tail = 1 + std::min(CountFrom(null.scan, statistics.Scan(bins)),
                                   CountFrom(null.trend, statistics.Trend(bins)));
  const auto more_uneven = std::ranges::upper_bound(null.smallest_tail, tail) - null.smallest_tail.begin();
  return (1 + static_cast<double>(more_uneven)) / (kPermutations + 1);
}

double RangeScan::UnorderedP(std::span<const RateBin> bins) {
  const Statistics statistics(bins);
  if (!CanDiffer(bins, statistics)) return 1;
  const double observed = statistics.RatioOfAll(bins);
  int as_uneven = 0;
  VisitPermutations(bins, statistics, [&](std::span<const RateBin> permuted) {
    as_uneven += statistics.RatioOfAll(permuted) >= observed - kEqual;
  });
  return (1.0 + as_uneven) / (kPermutations + 1);
}

}  // namespace evalbus::metrics
