// Whether two runs, or two suites, really differ. Pure: from runs read back to a struct; text and JSON of it
// are made apart. Differences are always the run's value less the baseline's.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/results/run_reader.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/newcombe.h"

namespace evalbus::results {

// What a difference between a run and its baseline comes to. kDiffers: there is one, and nothing says which
// side is the better one.
enum class Judgment { kNone, kBetter, kWorse, kDiffers };

// For people; empty for none.
const char* Word(Judgment judgment);

struct SuccessCounts {
  int successes = 0, trials = 0;
  int baseline_successes = 0, baseline_trials = 0;
  // a: the run, b: the baseline; only where paired.
  metrics::PairCounts pairs;

  void Add(const SuccessCounts& other);
};

// The test that a p value of success comes from.
enum class SuccessTest { kMcNemar, kFisher, kSequentialMcNemar };

// Two success rates. Paired: both over the episodes that both have; exact McNemar test, Newcombe's interval
// for pairs. Otherwise: Fisher's test, Newcombe's interval for independent samples.
struct SuccessComparison : SuccessCounts {
  bool paired = false;
  // What the test counts: the same numbers, except that a task counts once where all its episodes, or pairs,
  // are one sample (metrics::NumSamples). Rates, and the difference, are over all.
  SuccessCounts samples;
  double difference = 0;
  metrics::Interval difference_95{};
  SuccessTest test = SuccessTest::kMcNemar;
  double p = 1;
  // Adjusted: by Holm, over the runs that are compared with the same baseline, or over the tasks of a suite;
  // of a plan that stops when decided by Bonferroni, over its policies.
  double p_adjusted = 1;
  // p_adjusted is small enough to call it a difference.
  bool is_shown = false;
  // How many comparisons share the 5 %.
  int family = 1;

  void Add(const SuccessComparison& other);  // of another task; then Test()
  void Test();
  // Sets p adjusted by Holm for so many comparisons.
  void SetAdjusted(double p_holm, size_t comparisons);
  // Replaces the test by the sequential one of a plan that stops when decided.
  void SetSequential(double sequential_p, double adjusted, bool is_decided);
  Judgment judgment() const;
};

// What episodes, or pairs, of this kind can find. For independent samples: episodes on each side.
struct Outlook {
  // Smallest true difference that the present number finds four times in five; nothing if it finds none.
  std::optional<double> findable;
  // Number that finds the observed difference four times in five, if that is the true one; nothing if there
  // is no difference, or more than metrics::kMaxTrials are needed.
  std::optional<int> needed;
};
Outlook OutlookOf(const SuccessComparison& success);

// A metric over the complete episodes that have it; metrics of effort only over those that succeeded. Paired:
// interval of the mean difference, Wilcoxon's signed-rank test. Otherwise: of the difference of means,
// Mann-Whitney's test.
struct MetricComparison {
  MetricNumber number;
  // Values on each side; equal where paired.
  int count = 0, baseline_count = 0;
  double mean = 0, baseline_mean = 0;
  double difference = 0;
  metrics::Interval difference_95{};
  // Nothing where no value differs from any other.
  std::optional<double> p;
  // By Holm, over the metrics with a p.
  double p_holm = 1;
  // Whether a difference in favor of the run, and of the baseline, is a merit (WhyNoMerit in comparison.cc).
  bool may_be_better = true, baseline_may_be_better = true;
  // mean / baseline_mean of a metric of effort, on pairs that both succeeded.
  std::optional<double> ratio;
  metrics::Interval ratio_95{};

  bool differs() const { return p && p_holm < metrics::kAlpha; }
  Judgment judgment() const;
};

// A pair that one of the two succeeded in.
struct FlippedPair {
  int64_t seed = 0;
  int episode = 0, baseline_episode = 0;
  // Of the run; the baseline's is the other.
  bool success = false;
  // Why the other one did not succeed.
  std::string failure_reason;
};

struct TaskComparison {
  std::string task, variation, baseline_variation;
  std::filesystem::path folder, baseline_folder;
  bool paired = false;
  // Complete episodes without a partner, left out where paired.
  int unmatched = 0, baseline_unmatched = 0;
  // By episode; none where not paired.
  std::vector<FlippedPair> flipped;
  SuccessComparison success;
  std::vector<MetricComparison> metrics;

  // "lift_pot/position"; of two variations "lift_pot/position against lift_pot/base".
  std::string name() const;
};

struct ComparedRuns {
  std::string name, folder, policy;
};

struct Comparison {
  ComparedRuns run, baseline;
  // Of one run the one task that it has.
  std::vector<TaskComparison> tasks;
  // Over all tasks.
  SuccessComparison success;
  // What is left out, a sentence each.
  std::vector<std::string> remarks;
};

// Episodes are pairs where task, variation and seed are the same. Throws InputError where values cannot be
// compared: other control rate, task description or physics model, or no task in common.
Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline);
// Compares success alone, over all tasks.
SuccessComparison CompareSuccess(const RecordedRuns& run, const RecordedRuns& baseline);
// Each against the baseline, with p values of success adjusted for all of them.
std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline);

// "B succeeds more often than A: 43 of 50 against 31 of 50 on the same seeds, ..."; that two variations are
// compared comes first.
std::string Conclusion(const Comparison& comparison);

// Describes which episodes the means of a task's metrics are over, and which test p comes from.
std::string WhatIsCounted(const TaskComparison& task);
inline constexpr char kIntervalsAreSingle[] =
    "Intervals are not adjusted: each covers 95 % for its metric alone.";

// "exact McNemar", as sentences and tables name it.
const char* TestName(SuccessTest test);

}  // namespace evalbus::results
