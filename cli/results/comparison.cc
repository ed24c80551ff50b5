#include "cli/results/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/plural.h"
#include "base/text.h"
#include "cli/results/comparability.h"
#include "metrics/statistics/bootstrap.h"
#include "metrics/statistics/fisher.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/mann_whitney.h"
#include "metrics/statistics/mcnemar.h"
#include "metrics/statistics/run_statistics.h"
#include "metrics/statistics/ties.h"
#include "metrics/statistics/wilcoxon.h"

namespace evalbus::results {
namespace {

constexpr char kWristPath[] = "cartesian_path_length";

using BySeed = std::map<int64_t, const RecordedEpisode*>;

BySeed CompleteBySeed(const RecordedRun& run) {
  BySeed scored;
  for (const RecordedEpisode& episode : run.episodes) {
    if (episode.complete) scored[episode.seed] = &episode;
  }
  return scored;
}

// Leave one of those that are equal in every number, and return how many they dropped.
int DropRepeated(BySeed* episodes) {
  const auto less = [](const RecordedEpisode* a, const RecordedEpisode* b) { return a->result < b->result; };
  std::set<const RecordedEpisode*, decltype(less)> seen(less);
  return static_cast<int>(
      std::erase_if(*episodes, [&](const auto& entry) { return !seen.insert(entry.second).second; }));
}
int DropRepeatedPairs(BySeed* run, BySeed* baseline) {
  using Pair = std::pair<const RecordedEpisode*, const RecordedEpisode*>;
  const auto less = [](const Pair& a, const Pair& b) {
    return std::tie(a.first->result, a.second->result) < std::tie(b.first->result, b.second->result);
  };
  std::set<Pair, decltype(less)> seen(less);
  const size_t before = run->size();
  std::erase_if(*run, [&](const auto& entry) {
    const auto partner = baseline->find(entry.first);
    if (seen.emplace(entry.second, partner->second).second) return false;
    baseline->erase(partner);
    return true;
  });
  return static_cast<int>(before - run->size());
}

// No wrist went further in any episode; unknown where a task does not track it.
constexpr double kNoWay = 0.01;  // m
bool NeverMoved(const BySeed& episodes) {
  bool is_known = false;
  for (const auto& [seed, scored] : episodes) {
    for (const auto& [name, value] : scored->result.values) {
      if (name != kWristPath && !name.starts_with(std::string(kWristPath) + ".")) continue;
      if (value >= kNoWay) return false;
      is_known = true;
    }
  }
  return is_known;
}

// p and interval of a metric from its values.
void TestPaired(const std::vector<double>& values, const std::vector<double>& baseline,
                MetricComparison* metric) {
  const std::vector<double> differences = metrics::PairedDifferences(values, baseline);
  metric->difference = metrics::Mean(differences);
  metric->difference_95 = metrics::BootstrapMean(differences);
  if (std::any_of(differences.begin(), differences.end(), [](double d) { return d != 0; })) {
    metric->p = metrics::WilcoxonSignedRankTest(differences).p;
  }
  if (metric->number.metric->effort && metric->baseline_mean > 0) {
    metric->ratio = metric->mean / metric->baseline_mean;
    metric->ratio_95 = metrics::BootstrapRatioOfMeans(values, baseline);
  }
}

void TestUnpaired(const std::vector<double>& values, const std::vector<double>& baseline,
                  MetricComparison* metric) {
  metric->difference = metric->mean - metric->baseline_mean;
  metric->difference_95 = metrics::BootstrapDifferenceOfMeans(values, baseline);
  std::vector<double> all = values;
  all.insert(all.end(), baseline.begin(), baseline.end());
  const auto [least, most] = std::minmax_element(all.begin(), all.end());
  if (*most - *least > metrics::kTie * metrics::LargestMagnitude(all)) {
    metric->p = metrics::MannWhitneyTest(values, baseline).p;
  }
}

// The main metrics that any of the episodes has.
std::vector<MetricNumber> MainMetricsOf(const BySeed& run, const BySeed& baseline) {
  std::set<std::string> names;
  for (const auto* episodes : {&run, &baseline}) {
    for (const auto& [seed, scored] : *episodes) {
      for (const auto& [name, value] : scored->result.values) names.emplace(name);
    }
  }
  return MainMetrics({names.begin(), names.end()});
}

std::vector<MetricComparison> CompareMetrics(const BySeed& run, const BySeed& baseline, bool paired) {
  std::vector<MetricComparison> metrics;
  const bool run_never_moved = NeverMoved(run), baseline_never_moved = NeverMoved(baseline);
  for (const MetricNumber& number : MainMetricsOf(run, baseline)) {
    const auto value = [&](const RecordedEpisode* scored) -> std::optional<double> {
      const auto found = std::ranges::find(
          scored->result.values, number.name, [](const auto& named) -> const auto& { return named.first; });
      const bool counts = !number.metric->effort || scored->success;
      return found == scored->result.values.end() || !counts ? std::nullopt : std::optional(found->second);
    };
    std::vector<double> values, baseline_values;
    for (const auto& [seed, scored] : run) {
      const auto own = value(scored);
      if (!own) continue;
      if (paired) {
        const auto other = value(baseline.at(seed));
        if (!other) continue;
        baseline_values.push_back(*other);
      }
      values.push_back(*own);
    }
    for (const auto& [seed, scored] : baseline) {
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
                            .run_never_moved = run_never_moved,
                            .baseline_never_moved = baseline_never_moved,
                            .ratio = std::nullopt,
                            .ratio_95 = {}};
    (paired ? TestPaired : TestUnpaired)(values, baseline_values, &metric);
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

TaskComparison CompareTask(const RecordedRun& run, const RecordedRun& baseline) {
  CheckComparable(run, baseline);
  TaskComparison result{.task = run.task,
                        .variation = run.variation,
                        .baseline_variation = baseline.variation,
                        .folder = run.folder,
                        .baseline_folder = baseline.folder,
                        .paired = false,
                        .unmatched = 0,
                        .baseline_unmatched = 0,
                        .repeated = 0,
                        .baseline_repeated = 0,
                        .flipped = {},
                        .success = {},
                        .metrics = {}};
  auto own = CompleteBySeed(run), other = CompleteBySeed(baseline);
  const auto partner = [](const auto& in) {
    return [&in](const auto& entry) { return in.contains(entry.first); };
  };
  result.paired = run.variation == baseline.variation && std::any_of(own.begin(), own.end(), partner(other));
  if (result.paired) {
    const auto drop = [&](auto* from, const auto& in) {
      return static_cast<int>(std::erase_if(*from, [&](const auto& entry) { return !partner(in)(entry); }));
    };
    result.unmatched = drop(&own, other);
    result.baseline_unmatched = drop(&other, own);
    result.repeated = result.baseline_repeated = DropRepeatedPairs(&own, &other);
  } else {
    result.repeated = DropRepeated(&own);
    result.baseline_repeated = DropRepeated(&other);
  }
  SuccessComparison& success = result.success;
  success.paired = result.paired;
  for (const auto& [seed, scored] : own) {
    if (!scored->judged()) continue;
    ++success.trials;
    success.successes += scored->success;
    if (!result.paired) continue;
    const RecordedEpisode& partner_of = *other.at(seed);
    if (!partner_of.judged()) continue;
    const bool a = scored->success, b = partner_of.success;
    if (a != b) {
      result.flipped.push_back({.seed = seed,
                                .episode = scored->episode,
                                .baseline_episode = partner_of.episode,
                                .success = a,
                                .failure_reason = (a ? partner_of : *scored).failure_reason});
    }
    ++(a && b ? success.pairs.both
       : a    ? success.pairs.only_a
       : b    ? success.pairs.only_b
              : success.pairs.neither);
  }
  std::ranges::sort(result.flipped, {}, &FlippedPair::episode);
  for (const auto& [seed, scored] : other) {
    if (!scored->judged()) continue;
    ++success.baseline_trials;
    success.baseline_successes += scored->success;
  }
  success.Test();
  result.metrics = CompareMetrics(own, other, result.paired);
  return result;
}

ComparedRuns About(const RecordedRuns& runs) {
  return {Printable(runs.name), runs.folder.string(), Printable(runs.runs.front().policy)};
}

void AddRemarks(const RecordedRuns& runs, std::vector<std::string>* remarks) {
  for (const RecordedRun& run : runs.runs) {
    for (const std::string& remark : run.Remarks()) remarks->push_back(run.name + ": " + remark);
  }
}

// "1 episode of b and 2 of a"
std::string Counted(const std::string& what, int count, const std::string& run, int baseline_count,
                    const std::string& baseline) {
  return fmt::format("{} of {} and {} of {}", Plural(count, what), run, baseline_count, baseline);
}

void AddRemarks(const TaskComparison& task, const std::string& run, const std::string& baseline,
                std::vector<std::string>* remarks) {
  const std::string name = task.name();
  if (task.unmatched + task.baseline_unmatched > 0) {
    remarks->push_back(
        fmt::format("{}: without a partner, and left out: {}", name,
                    Counted("episode", task.unmatched, run, task.baseline_unmatched, baseline)));
  }
  if (task.repeated + task.baseline_repeated > 0) {
    remarks->push_back(fmt::format(
        "{}: equal to another in every number, so no sample of its own, and left out: {}", name,
        task.paired ? fmt::format("{} of {} pairs", task.repeated, task.repeated + task.success.trials)
                    : Counted("episode", task.repeated, run, task.baseline_repeated, baseline)));
  }
  if (!task.paired) {
    remarks->push_back(name + (task.variation != task.baseline_variation ? "" : ": no seed in common") +
                       ": compared as independent samples");
  }
  if (task.metrics.empty()) return;
  for (const auto& [still, who] :
       {std::pair(task.metrics[0].run_never_moved, run), {task.metrics[0].baseline_never_moved, baseline}}) {
    if (!still) continue;
    remarks->push_back(fmt::format(
        "{}: {} never moved its arms (no wrist by {:.0f} mm), so in no metric is it called better", name, who,
        kNoWay * 1e3));
  }
}

}  // namespace

const char* Word(Judgement judgement) {
  switch (judgement) {
    case Judgement::kBetter:
      return "better";
    case Judgement::kWorse:
      return "worse";
    case Judgement::kDiffers:
      return "differs";
    case Judgement::kNone:
      break;
  }
  return "";
}

void SuccessComparison::Add(const SuccessComparison& other) {
  successes += other.successes;
  trials += other.trials;
  baseline_successes += other.baseline_successes;
  baseline_trials += other.baseline_trials;
  pairs.both += other.pairs.both;
  pairs.only_a += other.pairs.only_a;
  pairs.only_b += other.pairs.only_b;
  pairs.neither += other.pairs.neither;
}

Judgement SuccessComparison::judgement() const {
  if (p_holm >= metrics::kAlpha) return Judgement::kNone;
  return difference > 0 ? Judgement::kBetter : Judgement::kWorse;
}

Judgement MetricComparison::judgement() const {
  if (!differs()) return Judgement::kNone;
  const bool is_up = difference_95.lower > 0, is_down = difference_95.upper < 0;
  const Better better = number.metric->better;
  if (better == Better::kNeither || !(is_up || is_down)) return Judgement::kDiffers;
  const bool is_better = is_up == (better == Better::kHigher);
  if (is_better ? run_never_moved : baseline_never_moved) return Judgement::kDiffers;
  return is_better ? Judgement::kBetter : Judgement::kWorse;
}

void SuccessComparison::Test() {
  if (trials == 0 || baseline_trials == 0) {
    difference_95 = {-1, 1};
    return;
  }
  const double baseline_rate = static_cast<double>(baseline_successes) / baseline_trials;
  difference = static_cast<double>(successes) / trials - baseline_rate;
  if (paired) {
    difference_95 = metrics::NewcombePairedInterval(pairs);
    p = metrics::McNemarTest(pairs.only_a, pairs.only_b);
    const int against = std::min(pairs.only_a, pairs.only_b);
    for (int more = 1; against * 2 + more <= trials && !detectable; ++more) {
      if (metrics::McNemarTest(against + more, against) < metrics::kAlpha)
        detectable = static_cast<double>(more) / trials;
    }
  } else {
    difference_95 = metrics::NewcombeInterval(successes, trials, baseline_successes, baseline_trials);
    p = metrics::FisherTest(successes, trials, baseline_successes, baseline_trials);
    for (int k = 0; k <= trials; ++k) {
      const double apart = std::abs(static_cast<double>(k) / trials - baseline_rate);
      if (metrics::FisherTest(k, trials, baseline_successes, baseline_trials) < metrics::kAlpha)
        detectable = std::min(detectable.value_or(1), apart);
    }
  }
  p_holm = p;
}

std::string TaskComparison::name() const {
  const std::string own = task + "/" + variation;
  return variation == baseline_variation ? own : own + " against " + task + "/" + baseline_variation;
}

Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline) {
  Comparison result{
      .run = About(run), .baseline = About(baseline), .tasks = {}, .success = {}, .remarks = {}};
  const bool single = run.runs.size() == 1 && baseline.runs.size() == 1;
  std::set<std::string> made_differently;
  for (const RecordedRun& own : run.runs) {
    const auto other =
        std::find_if(baseline.runs.begin(), baseline.runs.end(), [&](const RecordedRun& candidate) {
          return candidate.task == own.task && (single || candidate.variation == own.variation);
        });
    if (other == baseline.runs.end()) {
      result.remarks.push_back(fmt::format("{} is not in {}: left out", own.task_name(), baseline.name));
      continue;
    }
    result.tasks.push_back(CompareTask(own, *other));
    if (const std::string how = MadeDifferently(own, *other);
        !how.empty() && made_differently.insert(how).second) {
      result.remarks.push_back(fmt::format("{} and {} were made with {}: that alone may make them differ",
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
      result.remarks.push_back(fmt::format("{} is not in {}: left out", other.task_name(), run.name));
    }
  }
  result.success.paired = std::all_of(result.tasks.begin(), result.tasks.end(),
                                      [](const TaskComparison& task) { return task.paired; });
  std::vector<double> p;
  for (const TaskComparison& task : result.tasks) {
    result.success.Add(task.success);
    p.push_back(task.success.p);
    AddRemarks(task, run.name, baseline.name, &result.remarks);
  }
  result.success.Test();
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0; i < adjusted.size(); ++i) result.tasks[i].success.p_holm = adjusted[i];
  AddRemarks(baseline, &result.remarks);
  AddRemarks(run, &result.remarks);
  return result;
}

std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline) {
  std::vector<Comparison> comparisons;
  std::vector<double> p;
  for (const RecordedRuns& run : runs) {
    comparisons.push_back(CompareRuns(run, baseline));
    p.push_back(comparisons.back().success.p);
  }
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0; i < adjusted.size(); ++i) comparisons[i].success.p_holm = adjusted[i];
  return comparisons;
}

std::string Conclusion(const Comparison& comparison) {
  const SuccessComparison& success = comparison.success;
  const std::string &run = comparison.run.name, &baseline = comparison.baseline.name;
  std::string variations;
  if (const TaskComparison& task = comparison.tasks[0]; task.variation != task.baseline_variation) {
    variations = fmt::format(
        "These are two variations: {} ran {}/{} and {} ran {}/{}, so policy and task differ at the same "
        "time. ",
        run, task.task, task.variation, baseline, task.task, task.baseline_variation);
  }
  if (success.trials == 0 || success.baseline_trials == 0) {
    return variations + fmt::format("Nothing can be said: {} has no complete episode.",
                                    success.trials == 0 ? run : baseline);
  }
  const bool shown = success.p_holm < metrics::kAlpha;
  const std::string counts = fmt::format("{} of {} against {} of {}{}", success.successes, success.trials,
                                         success.baseline_successes, success.baseline_trials,
                                         success.paired ? " on the same seeds" : "");
  std::string test = success.paired ? "exact McNemar" : "Fisher's exact test";
  if (success.p_holm != success.p) test += ", adjusted by Holm,";
  const std::string p =
      success.p_holm < 0.001 ? test + " p < 0.001" : fmt::format("{} p = {:.2g}", test, success.p_holm);
  const std::string numbers = fmt::format(
      "{}, difference {} points (95 % interval {} to {}), {}", counts, Fixed(success.difference * 100, 0),
      Fixed(success.difference_95.lower * 100, 0), Fixed(success.difference_95.upper * 100, 0), p);
  if (shown) {
    return variations + fmt::format("{} succeeds {} often than {}: {}.", run,
                                    success.difference > 0 ? "more" : "less", baseline, numbers);
  }
  const std::string what = success.paired
                               ? Plural(success.trials, "pair")
                               : fmt::format("{} and {} episodes", success.trials, success.baseline_trials);
  const std::string limit =
      success.detectable ? fmt::format("{} like these can only show differences from about {:.0f} points on",
                                       what, *success.detectable * 100)
                         : fmt::format("{} {} too few to show any difference", what,
                                       success.paired && success.trials == 1 ? "is" : "are");
  return variations +
         fmt::format("No difference shown between {} and {}: {}; {}.", run, baseline, numbers, limit);
}

}  // namespace evalbus::results
