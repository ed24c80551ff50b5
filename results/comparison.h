// Compares two runs or two suites statistically. Has no side effects; comparison_text.h and comparison_json.h
// generate text and JSON. A difference is always the run's value minus the baseline's value.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/metric_catalog.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/sequential_mcnemar.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Result of comparing a run with its baseline. kDiffers: the values differ, but neither is known to be
// better.
enum class Judgment { kNone, kBetter, kWorse, kDiffers };

// Returns the display text; empty for kNone.
const char* Word(Judgment judgment);

struct SuccessCounts {
  int successes = 0, trials = 0;
  int baseline_successes = 0, baseline_trials = 0;
  // Outcomes of the pairs. a: the run, b: the baseline. Set only if paired.
  metrics::PairCounts pairs;
  // Number of pairs in which each side is ahead. A side is ahead if only it succeeded. If success is equal,
  // the side with more stages is ahead; if the stages are also equal and both succeeded, the faster side. Set
  // only if paired.
  metrics::Wins ahead;

  void Add(const SuccessCounts& other);
};

// The statistical test of the success rates.
enum class SuccessTest { kMcNemar, kFisher, kSequentialMcNemar };

// Comparison of two success rates. If paired, both rates cover the episodes with seeds that both sides have;
// the test is the exact McNemar test, and the interval is Newcombe's interval for pairs. Otherwise the test
// is Fisher's exact test, and the interval is Newcombe's interval for independent samples.
struct SuccessComparison : SuccessCounts {
  bool paired = false;
  // The counts that the test uses. They equal the counts of the base class, except that a task whose episodes
  // (or pairs) are all one sample (metrics::NumSamples) counts once. Rates and the difference use all
  // episodes.
  SuccessCounts samples;
  double difference = 0;
  metrics::Interval difference_95{};
  SuccessTest test = SuccessTest::kMcNemar;
  double p = 1;
  // p adjusted with Holm's method for a family of comparisons, such as the runs compared with the same
  // baseline or the tasks of a suite (AdjustByHolm()). In a plan with `until`, p adjusted with Bonferroni's
  // method.
  double p_adjusted = 1;
  // True if p_adjusted is significant or, in a plan with `until`, if the sequential test has decided.
  bool is_shown = false;
  // Number of comparisons for which p is adjusted.
  int family = 1;

  // Returns false if a side has no complete episode with a verdict. There is then no difference, interval or
  // p.
  bool has_both_sides() const { return trials > 0 && baseline_trials > 0; }
  // Returns true if `samples` has fewer episodes. Its difference may then differ from `difference`.
  bool has_fewer_samples() const {
    return samples.trials < trials || samples.baseline_trials < baseline_trials;
  }

  void Add(const SuccessComparison& other);  // adds another task; call Test() afterwards
  void Test();
  // Sets p_adjusted to p_holm, which was adjusted for this number of comparisons.
  void SetAdjusted(double p_holm, size_t comparisons);
  // Replaces the test by the sequential test of a plan with `until`.
  void SetSequential(double sequential_p, double adjusted, bool is_decided);
  Judgment judgment() const;
};

// Adjusts the p values of a family of comparisons with Holm's method.
void AdjustByHolm(const std::vector<SuccessComparison*>& family);

// Statistical power of a number of pairs or, for independent samples, of a number of episodes per side.
struct Outlook {
  // Smallest true difference that the current number detects with 80 % power; nullopt if it cannot detect
  // any.
  std::optional<double> findable;
  // Number that is needed to detect the observed difference with 80 % power, assuming that it is the true
  // difference. nullopt if the difference is 0, if more than metrics::kMaxTrials are needed, and if
  // has_fewer_samples() is true.
  std::optional<int> needed;
};
Outlook OutlookOf(const SuccessComparison& success);

// Reason why a better value of a metric does not make a side better.
struct NoMerit {
  // Display text if the run (of_run) or the baseline (of_baseline) is the side whose better value does not
  // count.
  const char *of_run, *of_baseline;
  // Predicate of a sentence whose subject is the name of that side.
  const char* sentence;
};

// Comparison of a metric over the complete episodes that have it; for effort metrics, only over the
// successful ones. If paired: interval of the mean difference and Wilcoxon signed-rank test. Otherwise:
// interval of the difference of means and Mann-Whitney test.
struct MetricComparison {
  MetricNumber number;
  // Number of values on each side; equal if paired.
  int count = 0, baseline_count = 0;
  double mean = 0, baseline_mean = 0;
  double difference = 0;
  metrics::Interval difference_95{};
  // p of the difference; nullopt if the two values of each pair are equal or, if not paired, if all values
  // are equal.
  std::optional<double> p;
  // RankTest::least_p of the test that yields p.
  double least_p = 1;
  // p adjusted with Holm's method for the metrics that have a p.
  double p_holm = 1;
  // Reason why a difference in favor of the run (no_merit) or of the baseline (baseline_no_merit) must not be
  // called better; null if there is none.
  const NoMerit *no_merit = nullptr, *baseline_no_merit = nullptr;
  // For paired effort metrics: the geometric mean of the ratios of the pairs; nullopt unless all values are
  // positive. For other metrics: mean / baseline_mean; nullopt if a value is negative or baseline_mean is 0.
  // The interval is then set only if paired.
  std::optional<double> ratio;
  metrics::Interval ratio_95{};

  // Returns the number of decimals for all numbers of this comparison in the display unit. It suits the
  // larger mean, but is limited by the standard error of the difference. If the difference is shown
  // (differs()) and would round to 0, there are up to six decimals, so that two of its digits are seen.
  int decimals() const;
  bool differs() const { return p && p_holm < metrics::kAlpha; }
  // Returns true if the interval of the difference is above (below) 0 or, without an interval, if the
  // difference is.
  bool is_higher() const;
  bool is_lower() const;
  // Returns the judgment that results if no_merit and baseline_no_merit are ignored.
  Judgment JudgmentByValue() const;
  Judgment judgment() const;
  // Returns the judgment in words, for example "better", or "lower (made less progress)" if a lower value
  // must not be called better.
  std::string word() const;
};

// An episode of a pair.
struct PairedEpisode {
  int episode = 0;
  bool success = false;
  std::string failure_reason;
  Cause cause;
};

// Two complete, judged episodes with equal seeds.
struct ComparedPair {
  int64_t seed = 0;
  PairedEpisode run, baseline;

  bool is_flipped() const { return run.success != baseline.success; }
  // Returns the side that failed. Must be called only if exactly one side failed.
  const PairedEpisode& failed() const { return run.success ? baseline : run; }
};

struct TaskComparison {
  std::string task, variation, baseline_variation;
  std::filesystem::path folder, baseline_folder;
  bool paired = false;
  // Number of compared episodes of each side, all of them complete, with or without a verdict. Both are the
  // number of pairs if paired.
  int complete = 0, baseline_complete = 0;
  // If paired: number of complete episodes without a counterpart, which are excluded. Otherwise 0.
  int unmatched = 0, baseline_unmatched = 0;
  // If paired: number of pairs in which an episode has no verdict. They are excluded from `pairs` and
  // `success`, but not from the metrics. Otherwise 0.
  int without_verdict = 0;
  // Ordered by the run's episodes; empty if not paired.
  std::vector<ComparedPair> pairs;
  SuccessComparison success;
  std::vector<MetricComparison> metrics;

  // Returns the pairs in which exactly one side succeeded.
  std::vector<ComparedPair> flipped() const;
  // Returns the name of the task, for example "lift_pot/position", or "lift_pot/position against
  // lift_pot/base" for two variations.
  std::string name() const;
};

struct ComparedRuns {
  std::string name, folder, policy;
};

struct Comparison {
  ComparedRuns run, baseline;
  // Names of the compared metrics, as chosen by the user; empty: the main metrics.
  std::vector<std::string> on;
  // Comparisons by task; a comparison of single runs has one entry.
  std::vector<TaskComparison> tasks;
  // Comparison over all tasks.
  SuccessComparison success;
  // Notes on the comparison, for example on what was excluded, one line each.
  std::vector<std::string> remarks;
};

// Compares the main metrics of two runs or suites. Episodes are paired if task, variation and seed are equal.
// Throws InputError if the runs have no common task, and the errors of CheckComparable().
Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline);
// Compares only success; the result has no metrics.
Comparison CompareVerdicts(const RecordedRuns& run, const RecordedRuns& baseline);
// Compares the success of each pair of runs, in the order (0, 1), (0, 2), ..., (1, 2), ... The second run of
// a pair is its baseline. p is adjusted with Holm's method for all pairs.
std::vector<SuccessComparison> CompareEachPair(const std::vector<const RecordedRuns*>& runs);
// Compares each run with the baseline, with p of success adjusted for the number of runs. on: names of the
// metrics to compare (FindNumbers()), of which "success" is always compared; empty: the main metrics.
// is_sequential: the caller will replace p of success (SetSequential()), so there is no note that p values
// assume a fixed number of episodes.
std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline,
                                   const std::vector<std::string>& on = {}, bool is_sequential = false);

}  // namespace evalbus::results
