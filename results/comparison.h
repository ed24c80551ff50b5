// Compares two runs or two suites statistically. Pure: converts runs that were read from disk into a struct;
// text and JSON are generated elsewhere. A difference is always the run's value minus the baseline's.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/metric_catalog.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/newcombe.h"
#include "metrics/statistics/sequential_mcnemar.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Result of comparing a run with its baseline. kDiffers: the values differ, but neither is known to be
// better.
enum class Judgment { kNone, kBetter, kWorse, kDiffers };

// Display text; empty for kNone.
const char* Word(Judgment judgment);

struct SuccessCounts {
  int successes = 0, trials = 0;
  int baseline_successes = 0, baseline_trials = 0;
  // a: the run, b: the baseline; set only if paired.
  metrics::PairCounts pairs;
  // Pairs in which one side is ahead: it alone succeeded; else it reached more stages; else, if both
  // succeeded, it took less time. Set only if paired.
  metrics::Wins ahead;

  void Add(const SuccessCounts& other);
};

// The test that p of the success rates comes from.
enum class SuccessTest { kMcNemar, kFisher, kSequentialMcNemar };

// Comparison of two success rates. Paired: both over the episodes that both sides have; exact McNemar test,
// Newcombe's interval for pairs. Unpaired: Fisher's test, Newcombe's interval for independent samples.
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
  // p adjusted by Holm, over the runs compared with the same baseline or over the tasks of a suite. For a
  // plan with `until`, adjusted by Bonferroni, over its policies.
  double p_adjusted = 1;
  // True if p_adjusted is significant.
  bool is_shown = false;
  // Number of comparisons that p is adjusted for.
  int family = 1;

  void Add(const SuccessComparison& other);  // adds another task; call Test() afterwards
  void Test();
  // Sets p_adjusted, as adjusted by Holm for this number of comparisons.
  void SetAdjusted(double p_holm, size_t comparisons);
  // Replaces the test by the sequential test of a plan with `until`.
  void SetSequential(double sequential_p, double adjusted, bool is_decided);
  Judgment judgment() const;
};

// Adjusts the p values of a family of comparisons by Holm.
void AdjustByHolm(const std::vector<SuccessComparison*>& family);

// Statistical power of a number of episodes or pairs. For independent samples: number of episodes per side.
struct Outlook {
  // Smallest true difference that the present number detects with 80 % power; nullopt if it cannot detect
  // any.
  std::optional<double> findable;
  // Number that detects the observed difference with 80 % power, if that is the true difference; nullopt if
  // the difference is 0 or more than metrics::kMaxTrials are needed.
  std::optional<int> needed;
};
Outlook OutlookOf(const SuccessComparison& success);

// Why a better value of a metric does not make a side better.
struct NoMerit {
  // For people, if the run, or the baseline, is the side without merit.
  const char *of_run, *of_baseline;
  // Follows the name of that side.
  const char* sentence;
};

// Comparison of a metric over the complete episodes that have it; effort metrics only over those that
// succeeded. Paired: interval of the mean difference, Wilcoxon signed-rank test. Unpaired: interval of the
// difference of means, Mann-Whitney test.
struct MetricComparison {
  MetricNumber number;
  // Number of values on each side; equal if paired.
  int count = 0, baseline_count = 0;
  double mean = 0, baseline_mean = 0;
  double difference = 0;
  metrics::Interval difference_95{};
  // nullopt if all values are equal.
  std::optional<double> p;
  // p adjusted by Holm, over the metrics with a p.
  double p_holm = 1;
  // Why a difference in favor of the run, or of the baseline, must not be called better; null if it may be.
  const NoMerit *no_merit = nullptr, *baseline_no_merit = nullptr;
  // The geometric mean of the ratios of the pairs for effort metrics over pairs, if all values are positive;
  // otherwise mean / baseline_mean, if no value is negative, with an interval only over pairs.
  std::optional<double> ratio;
  metrics::Interval ratio_95{};

  // Decimals of all its numbers in the display unit: those of the larger mean, limited by the standard error
  // of the difference.
  int decimals() const;
  bool differs() const { return p && p_holm < metrics::kAlpha; }
  // Whether the run's value is significantly higher (lower).
  bool is_higher() const;
  bool is_lower() const;
  // The judgment without regard to no_merit and baseline_no_merit.
  Judgment JudgmentByValue() const;
  Judgment judgment() const;
  // The judgment in words, for example "better"; "lower (made less progress)" if it is not called better.
  std::string word() const;
};

// One of the two episodes of a pair.
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
  // The side that failed, if only one did.
  const PairedEpisode& failed() const { return run.success ? baseline : run; }
};

struct TaskComparison {
  std::string task, variation, baseline_variation;
  std::filesystem::path folder, baseline_folder;
  bool paired = false;
  // Number of complete episodes without a counterpart; ignored if paired.
  int unmatched = 0, baseline_unmatched = 0;
  // Ordered by the run's episodes; empty if not paired.
  std::vector<ComparedPair> pairs;
  SuccessComparison success;
  std::vector<MetricComparison> metrics;

  // The pairs in which exactly one side succeeded.
  std::vector<ComparedPair> flipped() const;
  // For example "lift_pot/position", or "lift_pot/position against lift_pot/base" for two variations.
  std::string name() const;
};

struct ComparedRuns {
  std::string name, folder, policy;
};

struct Comparison {
  ComparedRuns run, baseline;
  // One entry for a comparison of single runs.
  std::vector<TaskComparison> tasks;
  // Over all tasks.
  SuccessComparison success;
  // What was excluded, one sentence each.
  std::vector<std::string> remarks;
};

// Compares two runs or suites. Episodes are paired if task, variation and seed are equal. Throws InputError
// if the values cannot be compared: different control rate, task description or physics model, or no common
// task.
Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline);
// Compares success alone: the result has no metrics.
Comparison CompareVerdicts(const RecordedRuns& run, const RecordedRuns& baseline);
// Compares the success of each pair of runs, in the order (0, 1), (0, 2), ..., (1, 2), ...: the first one
// with the second one as its baseline. p is adjusted by Holm for all pairs.
std::vector<SuccessComparison> CompareEachPair(const std::vector<const RecordedRuns*>& runs);
// Compares each run with the baseline, with p of success adjusted for the number of runs.
std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline);

}  // namespace evalbus::results
