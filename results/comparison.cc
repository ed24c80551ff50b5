#include "results/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/errors.h"
#include "base/text.h"
#include "metrics/statistics/exact_tests.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/interval_of_mean.h"
#include "metrics/statistics/power.h"
#include "metrics/statistics/rank_tests.h"
#include "metrics/statistics/run_statistics.h"
#include "metrics/statistics/ties.h"
#include "results/comparability.h"
#include "results/metric_choice.h"

namespace evalbus::results {
namespace {

using BySeed = std::map<int64_t, const RecordedEpisode*>;

BySeed CompleteBySeed(const RecordedRun& run) {
  BySeed scored;
  for (const RecordedEpisode& episode : run.episodes) {
    if (episode.complete) scored[episode.seed] = &episode;
  }
  return scored;
}

// The complete episodes of one of the two runs, and the values that decide whether the run may be called
// better.
struct Side {
  explicit Side(BySeed compared, bool is_simulated_run)
      : episodes(std::move(compared)), is_simulated(is_simulated_run) {
    std::vector<const metrics::EpisodeResult*> results;
    double sum = 0;
    int successes = 0;
    for (const auto& [seed, episode] : episodes) {
      results.push_back(episode);
      successes += episode->success;
      sum += episode->Find(kProgress).value_or(0);
    }
    num_samples = metrics::NumSamples(results);
    if (episodes.empty()) return;
    success_rate = successes / static_cast<double>(episodes.size());
    progress = sum / static_cast<double>(episodes.size());
  }

  // Returns true if this side has a lower success rate, or an equal one and less progress (mean
  // subtask_progress).
  bool GotLessFarThan(const Side& other) const {
    return std::pair(success_rate, progress) < std::pair(other.success_rate, other.progress);
  }
  bool GotNowhere() const { return success_rate == 0 && progress == 0; }

  static constexpr std::string_view kProgress = "subtask_progress";
  BySeed episodes;
  bool is_simulated;
  int num_samples = 0;
  double success_rate = 0, progress = 0;
};

// Returns why a better value of this metric must not be credited to `side`; null if it may be.
const NoMerit* WhyNoMerit(const MetricInfo& metric, const Side& side, const Side& other, bool paired) {
  static constexpr NoMerit kGotNowhere{"reached no stage", "baseline reached no stage",
                                       "succeeded in no episode and reached no stage"};
  static constexpr NoMerit kGotLessFar{"made less progress", "made more progress",
                                       "made less progress, which alone can improve a metric"};
  static constexpr NoMerit kOwnSuccesses{
      "own successes only", "own successes only",
      "is compared over its own successes only, which may have been the easier starts"};
  static constexpr NoMerit kRecording{"noise of a recording", "noise of a recording",
                                      "is compared with a recording, whose noise this metric amplifies"};
  if (side.GotNowhere()) return &kGotNowhere;
  if (metric.risk && side.GotLessFarThan(other)) return &kGotLessFar;
  if (metric.effort && !paired && (side.success_rate < 1 || other.success_rate < 1)) return &kOwnSuccesses;
  if (metric.amplifies_noise && side.is_simulated != other.is_simulated) return &kRecording;
  return nullptr;
}

// Sets ratio to the geometric mean of the ratios of the pairs. Each seed then has the same weight, and
// swapping the runs gives the reciprocal.
void SetRatioOfPairs(std::span<const double> values, std::span<const double> baseline,
                     MetricComparison* metric) {
  const auto is_positive = [](double value) { return value > 0; };
  if (!std::ranges::all_of(values, is_positive) || !std::ranges::all_of(baseline, is_positive)) return;
  std::vector<double> logarithms;
  for (size_t i = 0; i < values.size(); ++i) logarithms.push_back(std::log(values[i] / baseline[i]));
  const metrics::Interval interval = metrics::IntervalOfMean(logarithms);
  metric->ratio = std::exp(metrics::Mean(logarithms));
  metric->ratio_95 = {std::exp(interval.lower), std::exp(interval.upper)};
}

// Sets ratio to the ratio of the means, unless the baseline's mean is 0 or a value is negative: a ratio over
// values of both signs has no meaning.
void SetRatioOfMeans(std::span<const double> values, std::span<const double> baseline,
                     MetricComparison* metric) {
  const auto is_negative = [](double value) { return value < 0; };
  if (metric->baseline_mean > 0 && !std::ranges::any_of(values, is_negative) &&
      !std::ranges::any_of(baseline, is_negative)) {
    metric->ratio = metric->mean / metric->baseline_mean;
  }
}

void SetTest(const metrics::RankTest& test, MetricComparison* metric) {
  metric->p = test.p;
  metric->least_p = test.least_p;
}

// Computes difference, interval, p and ratio of a metric from its values.
void TestPaired(std::span<const double> values, std::span<const double> baseline, MetricComparison* metric) {
  const std::vector<double> differences = metrics::PairedDifferences(values, baseline);
  metric->difference = metrics::Mean(differences);
  metric->difference_95 = metrics::IntervalOfMean(differences);
  if (std::any_of(differences.begin(), differences.end(), [](double d) { return d != 0; })) {
    SetTest(metrics::WilcoxonSignedRankTest(differences), metric);
  }
  if (metric->number.metric->effort) return SetRatioOfPairs(values, baseline, metric);
  SetRatioOfMeans(values, baseline, metric);
  if (metric->ratio) metric->ratio_95 = metrics::IntervalOfRatio(values, baseline);
}

void TestUnpaired(std::span<const double> values, std::span<const double> baseline,
                  MetricComparison* metric) {
  metric->difference = metric->mean - metric->baseline_mean;
  metric->difference_95 = metrics::IntervalOfDifference(values, baseline);
  std::vector<double> all(values.begin(), values.end());
  all.insert(all.end(), baseline.begin(), baseline.end());
  const auto [least, most] = std::minmax_element(all.begin(), all.end());
  if (*most - *least > metrics::kTie * metrics::LargestMagnitude(all)) {
    SetTest(metrics::MannWhitneyTest(values, baseline), metric);
  }
  SetRatioOfMeans(values, baseline, metric);
}

// Returns the main metrics that at least one of the episodes has.
std::vector<MetricNumber> MainMetricsOf(const BySeed& run, const BySeed& baseline) {
  std::set<std::string> names;
  for (const auto* episodes : {&run, &baseline}) {
    for (const auto& [seed, scored] : *episodes) {
      for (const auto& [name, value] : scored->values) names.emplace(name);
    }
  }
  return MainMetrics({names.begin(), names.end()});
}

// Remarks on tasks or runs. Remarks with the same text share a line.
class NamedRemarks {
 public:
  void Add(const std::string& name, const std::string& text) {
    for (auto& [known, names] : names_by_text_) {
      if (known != text) continue;
      names += ", " + name;
      return;
    }
    names_by_text_.emplace_back(text, name);
  }
  void AddTo(std::vector<std::string>* remarks) const {
    for (const auto& [text, names] : names_by_text_) remarks->push_back(names + ": " + text);
  }

 private:
  std::vector<std::pair<std::string, std::string>> names_by_text_;
};

// Collects the reasons from WhyNoMerit(), one line for all metrics with the same reason.
class MeritRemarks {
 public:
  void Add(const std::string& run, const char* why, const MetricNumber& number) {
    std::string& metrics = metrics_[{run, why}];
    metrics += (metrics.empty() ? "" : "; ") + number.label();
  }
  void AddTo(NamedRemarks* remarks, const std::string& task) const {
    for (const auto& [run_why, metrics] : metrics_) {
      remarks->Add(task,
                   fmt::format("{} {}: not called better in {}", run_why.first, run_why.second, metrics));
    }
  }

 private:
  std::map<std::pair<std::string, std::string>, std::string> metrics_;
};

std::vector<MetricComparison> CompareMetrics(const Side& run, const Side& baseline, bool paired,
                                             const std::vector<MetricNumber>& numbers) {
  std::vector<MetricComparison> metrics;
  for (const MetricNumber& number : numbers) {
    const auto value = [&](const RecordedEpisode* scored) {
      const bool counts = !number.metric->effort || scored->success;
      return counts ? scored->Find(number.name) : std::nullopt;
    };
    std::vector<double> values, baseline_values;
    for (const auto& [seed, scored] : run.episodes) {
      const auto own = value(scored);
      if (!own) continue;
      if (paired) {
        const auto other = value(baseline.episodes.at(seed));
        if (!other) continue;
        baseline_values.push_back(*other);
      }
      values.push_back(*own);
    }
    for (const auto& [seed, scored] : baseline.episodes) {
      const auto own = paired ? std::nullopt : value(scored);
      if (own) baseline_values.push_back(*own);
    }
    if (values.empty() || baseline_values.empty()) continue;
    MetricComparison metric{.number = number,
                            .count = static_cast<int>(values.size()),
                            .baseline_count = static_cast<int>(baseline_values.size()),
                            .mean = metrics::Mean(values),
                            .baseline_mean = metrics::Mean(baseline_values),
                            .difference = 0,
                            .difference_95 = {},
                            .p = std::nullopt,
                            .p_holm = 1,
                            .no_merit = WhyNoMerit(*number.metric, run, baseline, paired),
                            .baseline_no_merit = WhyNoMerit(*number.metric, baseline, run, paired),
                            .ratio = std::nullopt,
                            .ratio_95 = metrics::kNoInterval};
    // Episodes that count as one sample are equal, so the test uses only the first one.
    std::span<const double> tested = values, baseline_tested = baseline_values;
    if (run.num_samples == 1 && (!paired || baseline.num_samples == 1)) tested = tested.first(1);
    if (baseline.num_samples == 1 && (!paired || run.num_samples == 1))
      baseline_tested = baseline_tested.first(1);
    (paired ? TestPaired : TestUnpaired)(tested, baseline_tested, &metric);
    metrics.push_back(metric);
  }
  std::vector<double> p;
  for (const MetricComparison& metric : metrics) {
    if (metric.p) p.push_back(*metric.p);
  }
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0, k = 0; i < metrics.size(); ++i) {
    if (metrics[i].p) metrics[i].p_holm = adjusted[k++];
  }
  return metrics;
}

// Returns the key that orders episodes by success, then by the stages reached, then, if successful, by time.
// A greater key is better.
std::tuple<bool, double, double> HowFar(const RecordedEpisode& episode) {
  return {episode.success, episode.Find(Side::kProgress).value_or(0),
          episode.success ? -episode.completion_time : 0};
}

// Calls use(seed, episode of the run, episode of the baseline) for each pair in which both have a verdict.
// Each episode of the run must have a counterpart.
template <class Use>
void ForEachJudgedPair(const Side& run, const Side& baseline, const Use& use) {
  for (const auto& [seed, episode] : run.episodes) {
    const RecordedEpisode& partner = *baseline.episodes.at(seed);
    if (episode->judged() && partner.judged()) use(seed, *episode, partner);
  }
}

SuccessCounts CountPairs(const Side& run, const Side& baseline) {
  SuccessCounts counts;
  ForEachJudgedPair(run, baseline,
                    [&](int64_t, const RecordedEpisode& episode, const RecordedEpisode& partner) {
                      const bool a = episode.success, b = partner.success;
                      ++counts.trials;
                      ++counts.baseline_trials;
                      counts.successes += a;
                      counts.baseline_successes += b;
                      ++(a && b ? counts.pairs.both
                         : a    ? counts.pairs.only_a
                         : b    ? counts.pairs.only_b
                                : counts.pairs.neither);
                      const auto order = HowFar(episode) <=> HowFar(partner);
                      counts.ahead.a += order > 0;
                      counts.ahead.b += order < 0;
                    });
  return counts;
}

SuccessCounts CountSuccesses(const Side& run, const Side& baseline, bool paired) {
  if (paired) return CountPairs(run, baseline);
  SuccessCounts counts;
  const auto count = [](const Side& side, int* successes, int* trials) {
    for (const auto& [seed, episode] : side.episodes) {
      *trials += episode->judged();
      *successes += episode->judged() && episode->success;
    }
  };
  count(run, &counts.successes, &counts.trials);
  count(baseline, &counts.baseline_successes, &counts.baseline_trials);
  return counts;
}

// If all episodes (or pairs) count as one sample, reduces the counts to a single episode (or pair).
SuccessCounts CountSamples(SuccessCounts counts, const Side& run, const Side& baseline, bool paired) {
  const auto one = [](int* successes, int* trials) {
    *trials = std::min(1, *trials);
    *successes = std::min(1, *successes);
  };
  const bool is_one = run.num_samples == 1, baseline_is_one = baseline.num_samples == 1;
  if (paired && !(is_one && baseline_is_one)) return counts;
  if (is_one) one(&counts.successes, &counts.trials);
  if (baseline_is_one) one(&counts.baseline_successes, &counts.baseline_trials);
  for (int* pairs : {&counts.pairs.both, &counts.pairs.only_a, &counts.pairs.only_b, &counts.pairs.neither,
                     &counts.ahead.a, &counts.ahead.b}) {
    *pairs = std::min(1, *pairs);
  }
  return counts;
}

PairedEpisode About(const RecordedEpisode& episode) {
  return {episode.episode, episode.success, episode.failure_reason, episode.cause};
}

std::vector<ComparedPair> PairsOf(const Side& run, const Side& baseline) {
  std::vector<ComparedPair> pairs;
  ForEachJudgedPair(run, baseline,
                    [&](int64_t seed, const RecordedEpisode& episode, const RecordedEpisode& partner) {
                      pairs.push_back({.seed = seed, .run = About(episode), .baseline = About(partner)});
                    });
  std::ranges::sort(pairs, {}, [](const ComparedPair& pair) { return pair.run.episode; });
  return pairs;
}

// Returns counts of both sides, for example "1 episode of b and 2 of a".
std::string Counted(const std::string& what, int count, const std::string& run, int baseline_count,
                    const std::string& baseline) {
  return fmt::format("{} of {} and {} of {}", Plural(count, what), run, baseline_count, baseline);
}

// Returns true if no number differs within any pair.
bool AllPairsAreEqual(const Side& run, const Side& baseline) {
  return std::ranges::all_of(run.episodes, [&](const auto& entry) {
    const RecordedEpisode &own = *entry.second, &partner = *baseline.episodes.at(entry.first);
    return own.success == partner.success && own.end_reason == partner.end_reason &&
           own.values == partner.values;
  });
}

// Adds notes on the comparison.
void AddRemarks(const TaskComparison& task, const Side& own, const Side& other, const std::string& run,
                const std::string& baseline, NamedRemarks* remarks) {
  const std::string name = task.name();
  if (task.unmatched + task.baseline_unmatched > 0) {
    remarks->Add(name,
                 fmt::format("excluded because the other run lacks them: {}",
                             Counted("episode", task.unmatched, run, task.baseline_unmatched, baseline)));
  }
  if (task.without_verdict > 0) {
    remarks->Add(name, fmt::format("excluded from the success rates because an episode has no verdict: {}",
                                   Plural(task.without_verdict, "pair")));
  }
  if (task.success.has_fewer_samples()) {
    const auto all_equal = [&](int count, const std::string& of) {
      remarks->Add(name, fmt::format("all {}{} have equal starts and equal numbers: interval and test count "
                                     "them as one",
                                     count, of));
    };
    if (task.paired) {
      all_equal(task.success.trials, " pairs");
    } else {
      if (own.num_samples == 1 && task.success.trials > 1)
        all_equal(task.success.trials, " episodes of " + run);
      if (other.num_samples == 1 && task.success.baseline_trials > 1)
        all_equal(task.success.baseline_trials, " episodes of " + baseline);
    }
  }
  if (!task.paired && task.complete > 0 && task.baseline_complete > 0) {
    remarks->Add(name, std::string(task.variation != task.baseline_variation ? "" : "no seed in common: ") +
                           "compared as independent samples");
  }
  if (task.paired && !(own.is_simulated && other.is_simulated)) {
    remarks->Add(
        name, fmt::format("evalbus did not randomize the starts of {}: episodes with equal numbers count as "
                          "pairs, whether or not their starts are equal",
                          !own.is_simulated && !other.is_simulated ? "either"
                          : own.is_simulated                       ? baseline
                                                                   : run));
  }
  std::vector<std::string> too_few, only_interval, only_test;
  for (const MetricComparison& metric : task.metrics) {
    if (metric.p && *metric.p >= metrics::kAlpha && metric.difference_95.excludes_0())
      (metric.least_p < metrics::kAlpha ? only_interval : too_few).push_back(metric.number.label());
    if (metric.differs() && !metric.is_higher() && !metric.is_lower())
      only_test.push_back(metric.number.label());
  }
  if (!too_few.empty()) {
    remarks->Add(name,
                 fmt::format("the interval of the mean difference excludes 0, but so few {} differ that the "
                             "test cannot reach p < 0.05: {}",
                             task.paired ? "pairs" : "values", fmt::join(too_few, "; ")));
  }
  if (!only_interval.empty()) {
    remarks->Add(name,
                 fmt::format("the interval of the mean difference excludes 0, but the test, which compares "
                             "ranks, shows no difference: {}",
                             fmt::join(only_interval, "; ")));
  }
  if (!only_test.empty()) {
    remarks->Add(name,
                 fmt::format("the test, which compares ranks, shows a difference, but the interval of the "
                             "mean difference contains 0: {}",
                             fmt::join(only_test, "; ")));
  }
  MeritRemarks merits;
  for (const MetricComparison& metric : task.metrics) {
    if (metric.judgment() != Judgment::kDiffers) continue;
    const Judgment freely = metric.JudgmentByValue();
    if (freely == Judgment::kBetter) {
      merits.Add(run, metric.no_merit->sentence, metric.number);
    } else if (freely == Judgment::kWorse) {
      merits.Add(baseline, metric.baseline_no_merit->sentence, metric.number);
    }
  }
  merits.AddTo(remarks, name);
}

struct CompareTaskOptions {
  std::string run_name, baseline_name;
  // Metrics to compare; nullopt: the main metrics.
  std::optional<std::vector<MetricNumber>> metrics;
};

TaskComparison CompareTask(const RecordedRun& run, const RecordedRun& baseline,
                           const CompareTaskOptions& options, NamedRemarks* remarks) {
  CheckComparable(run, baseline);
  TaskComparison result{.task = run.task,
                        .variation = run.variation,
                        .baseline_variation = baseline.variation,
                        .folder = run.folder,
                        .baseline_folder = baseline.folder,
                        .paired = false,
                        .complete = 0,
                        .baseline_complete = 0,
                        .unmatched = 0,
                        .baseline_unmatched = 0,
                        .without_verdict = 0,
                        .pairs = {},
                        .success = {},
                        .metrics = {}};
  auto episodes = CompleteBySeed(run), baseline_episodes = CompleteBySeed(baseline);
  const auto partner = [](const auto& in) {
    return [&in](const auto& entry) { return in.contains(entry.first); };
  };
  result.paired = run.variation == baseline.variation &&
                  std::any_of(episodes.begin(), episodes.end(), partner(baseline_episodes));
  if (result.paired) {
    const auto drop = [&](auto* from, const auto& in) {
      return static_cast<int>(std::erase_if(*from, [&](const auto& entry) { return !partner(in)(entry); }));
    };
    result.unmatched = drop(&episodes, baseline_episodes);
    result.baseline_unmatched = drop(&baseline_episodes, episodes);
  }
  const Side own(std::move(episodes), run.is_simulated()),
      other(std::move(baseline_episodes), baseline.is_simulated());
  result.complete = static_cast<int>(own.episodes.size());
  result.baseline_complete = static_cast<int>(other.episodes.size());
  SuccessComparison& success = result.success;
  success.paired = result.paired;
  static_cast<SuccessCounts&>(success) = CountSuccesses(own, other, result.paired);
  success.samples = CountSamples(success, own, other, result.paired);
  success.Test();
  if (result.paired) {
    result.pairs = PairsOf(own, other);
    result.without_verdict = static_cast<int>(own.episodes.size() - result.pairs.size());
  }
  result.metrics =
      CompareMetrics(own, other, result.paired,
                     options.metrics ? *options.metrics : MainMetricsOf(own.episodes, other.episodes));
  AddRemarks(result, own, other, options.run_name, options.baseline_name, remarks);
  // Two engines are compared with one policy on purpose.
  if (result.paired && run.engine() == baseline.engine() && AllPairsAreEqual(own, other)) {
    remarks->Add(result.name(),
                 fmt::format("all numbers of {} are equal on both sides, as if one policy had run twice",
                             Plural(static_cast<int>(own.episodes.size()), "pair")));
  }
  return result;
}

ComparedRuns About(const RecordedRuns& runs) {
  return {Printable(runs.name), runs.folder.string(), Printable(runs.runs.front().policy)};
}

void AddRemarks(const RecordedRuns& runs, std::vector<std::string>* remarks) {
  NamedRemarks named;
  for (const RecordedRun& run : runs.runs) {
    const std::string& name = runs.is_suite ? run.name : runs.name;
    for (const std::string& remark : run.Remarks()) named.Add(name, remark);
  }
  for (const std::string& missing : runs.missing) named.Add(runs.name + "/" + missing, "no finished episode");
  named.AddTo(remarks);
}

// Returns the names of all numbers of complete episodes.
std::set<std::string> NumbersOf(const RecordedRuns& runs) {
  std::set<std::string> names;
  for (const RecordedRun& run : runs.runs) {
    for (const auto& [seed, episode] : CompleteBySeed(run)) {
      for (const auto& [name, value] : episode->values) names.emplace(name);
    }
  }
  return names;
}

// Finds metrics by name among the numbers that both sides have.
std::vector<MetricNumber> ChosenMetrics(const std::vector<std::string>& on, const RecordedRuns& run,
                                        const RecordedRuns& baseline) {
  std::set<std::string> available = NumbersOf(run);
  std::erase_if(available, [of_baseline = NumbersOf(baseline)](const auto& name) {
    return !of_baseline.contains(name);
  });
  std::vector<MetricNumber> chosen;
  for (const std::string& name : on) {
    if (name == "success") continue;
    for (const MetricNumber& number : FindNumbers(name, available)) {
      if (!number.metric)
        throw InputError("--on " + name + ": this version of evalbus does not support the metric");
      if (std::ranges::count(chosen, number.name, &MetricNumber::name) > 0)
        throw InputError("--on " + name + ": is given twice");
      chosen.push_back(number);
    }
  }
  return chosen;
}

// Returns the note that p values assume a fixed number of episodes, if the runs are from a plan that stopped
// depending on its results; otherwise an empty string.
std::string FixedNumberNote(const RecordedRuns& runs) {
  const auto until = [](const RecordedRun& run) { return run.info.value("until", ""); };
  const auto stopped = std::ranges::find_if(runs.runs, [&](const auto& run) { return !until(run).empty(); });
  if (stopped == runs.runs.end()) return "";
  return fmt::format(
      "{}: its plan stopped depending on its results (until: {}): p values here assume a fixed number of "
      "episodes; use those of the plan's report",
      runs.name, until(*stopped));
}

// metrics: as in CompareTaskOptions. is_sequential: as in CompareAll().
Comparison Compare(const RecordedRuns& run, const RecordedRuns& baseline,
                   const std::optional<std::vector<MetricNumber>>& metrics, bool is_sequential = false) {
  Comparison result{
      .run = About(run), .baseline = About(baseline), .on = {}, .tasks = {}, .success = {}, .remarks = {}};
  const bool single = run.runs.size() == 1 && baseline.runs.size() == 1;
  std::set<std::string> made_differently;
  NamedRemarks task_remarks;
  for (const RecordedRun& own : run.runs) {
    const auto other =
        std::find_if(baseline.runs.begin(), baseline.runs.end(), [&](const RecordedRun& candidate) {
          return candidate.task == own.task && (single || candidate.variation == own.variation);
        });
    if (other == baseline.runs.end()) {
      result.remarks.push_back(fmt::format("{} is not in {}: excluded", own.task_name(), baseline.name));
      continue;
    }
    result.tasks.push_back(CompareTask(own, *other, {run.name, baseline.name, metrics}, &task_remarks));
    if (const std::string how = MadeDifferently(own, *other);
        !how.empty() && made_differently.insert(how).second) {
      result.remarks.push_back(fmt::format("{} and {} were made with {}, which alone may cause differences",
                                           run.name, baseline.name, how));
    }
  }
  if (result.tasks.empty()) {
    throw InputError(fmt::format("{} ({}) and {} ({}) have no task in common", run.name,
                                 run.runs[0].task_name(), baseline.name, baseline.runs[0].task_name()));
  }
  for (const RecordedRun& other : baseline.runs) {
    const bool used = std::any_of(result.tasks.begin(), result.tasks.end(), [&](const TaskComparison& task) {
      return task.task == other.task && task.baseline_variation == other.variation;
    });
    if (!used) {
      result.remarks.push_back(fmt::format("{} is not in {}: excluded", other.task_name(), run.name));
    }
  }
  // A task with verdicts on one side only would be part of that side's rate over all tasks alone.
  const auto is_compared = [](const TaskComparison& task) {
    return task.success.trials > 0 && task.success.baseline_trials > 0;
  };
  const auto is_excluded = [&](const TaskComparison& task) {
    return result.tasks.size() > 1 && !is_compared(task);
  };
  const bool any_counts = !std::ranges::all_of(result.tasks, is_excluded);
  result.success.paired = std::ranges::all_of(result.tasks, [&](const TaskComparison& task) {
    return task.paired || (any_counts && is_excluded(task));
  });
  std::vector<SuccessComparison*> family;
  for (TaskComparison& task : result.tasks) {
    family.push_back(&task.success);
    if (is_excluded(task)) {
      task_remarks.Add(task.name(), "excluded from the rates over all tasks: no verdicts to compare");
      continue;
    }
    result.success.Add(task.success);
  }
  task_remarks.AddTo(&result.remarks);
  result.success.Test();
  AdjustByHolm(family);
  AddRemarks(baseline, &result.remarks);
  AddRemarks(run, &result.remarks);
  if (is_sequential) return result;
  for (const RecordedRuns* of : {&baseline, &run}) {
    if (std::string note = FixedNumberNote(*of); !note.empty()) result.remarks.push_back(std::move(note));
  }
  return result;
}

}  // namespace

const char* Word(Judgment judgment) {
  switch (judgment) {
    case Judgment::kBetter:
      return "better";
    case Judgment::kWorse:
      return "worse";
    case Judgment::kDiffers:
      return "differs";
    case Judgment::kNone:
      break;
  }
  return "";
}

void SuccessCounts::Add(const SuccessCounts& other) {
  successes += other.successes;
  trials += other.trials;
  baseline_successes += other.baseline_successes;
  baseline_trials += other.baseline_trials;
  pairs.both += other.pairs.both;
  pairs.only_a += other.pairs.only_a;
  pairs.only_b += other.pairs.only_b;
  pairs.neither += other.pairs.neither;
  ahead.a += other.ahead.a;
  ahead.b += other.ahead.b;
}

void SuccessComparison::Add(const SuccessComparison& other) {
  SuccessCounts::Add(other);
  samples.Add(other.samples);
}

void SuccessComparison::SetAdjusted(double p_holm, size_t comparisons) {
  p_adjusted = p_holm;
  is_shown = p_holm < metrics::kAlpha;
  family = static_cast<int>(comparisons);
}

void AdjustByHolm(const std::vector<SuccessComparison*>& family) {
  std::vector<double> p;
  for (const SuccessComparison* comparison : family) p.push_back(comparison->p);
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0; i < family.size(); ++i) family[i]->SetAdjusted(adjusted[i], family.size());
}

void SuccessComparison::SetSequential(double sequential_p, double adjusted, bool is_decided) {
  test = SuccessTest::kSequentialMcNemar;
  p = sequential_p;
  p_adjusted = adjusted;
  is_shown = is_decided;
}

Judgment SuccessComparison::judgment() const {
  if (!is_shown) return Judgment::kNone;
  return difference > 0 ? Judgment::kBetter : Judgment::kWorse;
}

bool MetricComparison::is_higher() const {
  // There is no interval if all pairs differ by the same amount or, for independent samples, if the values on
  // neither side vary, or if a side has only one value.
  return std::isnan(difference_95.lower) ? difference > 0 : difference_95.lower > 0;
}

bool MetricComparison::is_lower() const {
  return std::isnan(difference_95.lower) ? difference < 0 : difference_95.upper < 0;
}

int MetricComparison::decimals() const {
  const double scale = number.scale();
  const int usual = Decimals(scale * std::max(std::abs(mean), std::abs(baseline_mean)),
                             scale * metrics::StandardErrorOf(difference_95));
  const double shown = scale * std::abs(difference);
  if (!differs() || !(shown > 0) || shown >= 0.5 * std::pow(10, -usual)) return usual;
  constexpr int kMost = 6;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(shown))), usual, kMost);
}

Judgment MetricComparison::JudgmentByValue() const {
  if (!differs()) return Judgment::kNone;
  const Better better = number.metric->better;
  if (better == Better::kNeither || !(is_higher() || is_lower())) return Judgment::kDiffers;
  return is_higher() == (better == Better::kHigher) ? Judgment::kBetter : Judgment::kWorse;
}

Judgment MetricComparison::judgment() const {
  const Judgment freely = JudgmentByValue();
  const bool is_refused = (freely == Judgment::kBetter && no_merit != nullptr) ||
                          (freely == Judgment::kWorse && baseline_no_merit != nullptr);
  return is_refused ? Judgment::kDiffers : freely;
}

std::string MetricComparison::word() const {
  if (judgment() != Judgment::kDiffers || !(is_higher() || is_lower())) return Word(judgment());
  const std::string direction = is_higher() ? "higher" : "lower";
  switch (JudgmentByValue()) {
    case Judgment::kBetter:
      return direction + " (" + no_merit->of_run + ")";
    case Judgment::kWorse:
      return direction + " (" + baseline_no_merit->of_baseline + ")";
    default:
      return direction;
  }
}

void SuccessComparison::Test() {
  test = paired ? SuccessTest::kMcNemar : SuccessTest::kFisher;
  if (!has_both_sides()) {
    difference_95 = {-1, 1};
    return;
  }
  const double rate = static_cast<double>(successes) / trials,
               baseline_rate = static_cast<double>(baseline_successes) / baseline_trials;
  difference = rate - baseline_rate;
  if (paired) {
    difference_95 = metrics::NewcombePairedInterval(pairs, samples.pairs.pairs());
    p = metrics::McNemarTest(samples.pairs.only_a, samples.pairs.only_b);
  } else {
    difference_95 =
        metrics::NewcombeInterval(rate * samples.trials, samples.trials,
                                  baseline_rate * samples.baseline_trials, samples.baseline_trials);
    p = metrics::FisherTest(samples.successes, samples.trials, samples.baseline_successes,
                            samples.baseline_trials);
  }
  // If a task counts once in the test, the tested counts may favor the other side than the rates do. Such a
  // difference is not significant.
  const double tested = samples.successes * static_cast<double>(samples.baseline_trials) -
                        samples.baseline_successes * static_cast<double>(samples.trials);
  if (tested * difference < 0) p = 1;
  SetAdjusted(p, 1);
}

Outlook OutlookOf(const SuccessComparison& success) {
  const SuccessCounts& counts = success.samples;
  const double alpha = metrics::kAlpha / success.family;
  if (success.paired) {
    const double n = counts.pairs.pairs();
    const auto [against, more] = std::minmax(counts.pairs.only_a, counts.pairs.only_b);
    const double share_against = against / n;
    const metrics::DiscordantShares observed{more / n, share_against};
    Outlook outlook;
    outlook.findable = metrics::FindableDifference(
        [&](double difference) {
          return metrics::McNemarPower(counts.pairs.pairs(), {share_against + difference, share_against},
                                       alpha);
        },
        1 - 2 * share_against);
    if (more > against && !success.has_fewer_samples()) {
      outlook.needed =
          metrics::TrialsNeeded([&](int pairs) { return metrics::McNemarPower(pairs, observed, alpha); });
    }
    return outlook;
  }
  const double rate = static_cast<double>(success.successes) / success.trials,
               baseline_rate = static_cast<double>(success.baseline_successes) / success.baseline_trials;
  // The difference is added to a baseline rate of at most 50 % and subtracted from a higher one, because this
  // direction has more room for large differences.
  const bool is_up = baseline_rate <= 0.5;
  Outlook outlook;
  outlook.findable = metrics::FindableDifference(
      [&](double difference) {
        return is_up ? metrics::FisherPower(counts.trials, counts.baseline_trials, baseline_rate + difference,
                                            baseline_rate, alpha)
                     : metrics::FisherPower(counts.baseline_trials, counts.trials, baseline_rate,
                                            baseline_rate - difference, alpha);
      },
      is_up ? 1 - baseline_rate : baseline_rate);
  if (rate != baseline_rate && !success.has_fewer_samples()) {
    outlook.needed = metrics::TrialsNeeded([&](int trials) {
      return metrics::FisherPower(trials, trials, std::max(rate, baseline_rate),
                                  std::min(rate, baseline_rate), alpha);
    });
  }
  return outlook;
}

std::vector<ComparedPair> TaskComparison::flipped() const {
  std::vector<ComparedPair> flipped;
  std::ranges::copy_if(pairs, std::back_inserter(flipped), &ComparedPair::is_flipped);
  return flipped;
}

std::string TaskComparison::name() const {
  const std::string own = task + "/" + variation;
  return variation == baseline_variation ? own : own + " against " + task + "/" + baseline_variation;
}

Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline) {
  return Compare(run, baseline, std::nullopt);
}

Comparison CompareVerdicts(const RecordedRuns& run, const RecordedRuns& baseline) {
  return Compare(run, baseline, std::vector<MetricNumber>());
}

std::vector<SuccessComparison> CompareEachPair(const std::vector<const RecordedRuns*>& runs) {
  std::vector<SuccessComparison> pairs;
  for (size_t i = 0; i < runs.size(); ++i) {
    for (size_t j = i + 1; j < runs.size(); ++j) {
      pairs.push_back(CompareVerdicts(*runs[i], *runs[j]).success);
    }
  }
  std::vector<SuccessComparison*> family;
  for (SuccessComparison& pair : pairs) family.push_back(&pair);
  AdjustByHolm(family);
  return pairs;
}

std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline,
                                   const std::vector<std::string>& on, bool is_sequential) {
  std::vector<Comparison> comparisons;
  for (const RecordedRuns& run : runs) {
    std::optional<std::vector<MetricNumber>> metrics;
    if (!on.empty()) metrics = ChosenMetrics(on, run, baseline);
    comparisons.push_back(Compare(run, baseline, metrics, is_sequential));
    comparisons.back().on = on;
  }
  std::vector<SuccessComparison*> family;
  for (Comparison& comparison : comparisons) family.push_back(&comparison.success);
  AdjustByHolm(family);
  return comparisons;
}

}  // namespace evalbus::results
