#include "results/conclusion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "metrics/statistics/power.h"
#include "results/comparison_text.h"

namespace evalbus::results {
namespace {

// Formats the bounds of an interval in percentage points. They get one decimal if the interval is narrower
// than two points, or if it excludes 0 by less than half a point.
struct Points {
  explicit Points(const SuccessComparison& success) {
    const auto& [lower, upper] = success.difference_95;
    const bool excludes_0_closely =
        success.difference_95.excludes_0() && std::min(std::abs(lower), std::abs(upper)) < 0.005;
    decimals = upper - lower < 0.02 || excludes_0_closely ? 1 : 0;
  }
  std::string Text(double share) const { return PercentagePoints(share, decimals); }

  int decimals = 0;
};

// Formats a difference, with or without its sign.
std::string PointsOf(const SuccessComparison& success, double difference) {
  const double rate = static_cast<double>(success.successes) / success.trials;
  const double baseline = static_cast<double>(success.baseline_successes) / success.baseline_trials;
  return PercentagePoints(difference, std::max(Points(success).decimals, PointDecimals(rate, baseline)));
}

// Returns a sentence on the difference that this number of episodes can detect, and on the number needed to
// detect the observed difference.
std::string OutlookText(const SuccessComparison& success) {
  const SuccessCounts& counts = success.samples;
  const std::string what = success.paired
                               ? Plural(counts.trials, "pair")
                               : fmt::format("{} and {} episodes", counts.trials, counts.baseline_trials);
  const Outlook outlook = OutlookOf(success);
  if (!outlook.findable) {
    return fmt::format("{} like {} too few to detect any difference.", what,
                       success.paired && counts.trials == 1 ? "this is" : "these are");
  }
  const std::string text =
      fmt::format("{} like these detect a true difference of {:.0f} points with 80 % power", what,
                  std::ceil(*outlook.findable * 100));
  if (success.difference == 0 || success.has_fewer_samples()) return text + ".";
  const char* const kind = success.paired ? "pairs" : "episodes each";
  return fmt::format("{}; detecting one of {} points requires {} {}.", text,
                     PointsOf(success, std::abs(success.difference)),
                     outlook.needed ? fmt::format("about {}", *outlook.needed)
                                    : fmt::format("more than {}", metrics::kMaxTrials),
                     kind);
}

// Returns the tasks of a suite on which a difference is shown, for example "better on a, worse on b and c";
// empty if there are none. Of more than three tasks, only the number is returned.
std::string TasksThatDiffer(const Comparison& comparison) {
  if (comparison.tasks.size() < 2) return "";
  std::vector<std::string> parts;
  for (const Judgment judgment : {Judgment::kBetter, Judgment::kWorse}) {
    std::vector<std::string> names;
    for (const TaskComparison& task : comparison.tasks) {
      if (task.success.judgment() == judgment) names.push_back(task.name());
    }
    if (names.empty()) continue;
    parts.push_back(fmt::format(
        "{} on {}", Word(judgment),
        names.size() > 3 ? Plural(static_cast<int64_t>(names.size()), "task") : Enumerated(names)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

// Returns true if a side has complete episodes, with or without a verdict. count: their number on this side.
bool HasComplete(const Comparison& comparison, int TaskComparison::*count) {
  return std::ranges::any_of(comparison.tasks,
                             [count](const TaskComparison& task) { return task.*count > 0; });
}

// Returns true if some task has episodes with a verdict on the side whose trials are given.
bool HasVerdicts(const Comparison& comparison, int SuccessCounts::*trials) {
  return std::ranges::any_of(comparison.tasks,
                             [trials](const TaskComparison& task) { return task.success.*trials > 0; });
}

}  // namespace

std::string Enumerated(const std::vector<std::string>& names) {
  if (names.size() < 2) return names.empty() ? "" : names.front();
  return fmt::format("{} and {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

const char* TestName(SuccessTest test) {
  switch (test) {
    case SuccessTest::kMcNemar:
      return "exact McNemar";
    case SuccessTest::kFisher:
      return "Fisher's exact test";
    case SuccessTest::kSequentialMcNemar:
      return "McNemar valid at any look";
  }
  return "";
}

std::string WhatIsCounted(const TaskComparison& task) {
  const SuccessComparison& success = task.success;
  if (task.paired) {
    return fmt::format(
        "Means over the {} with equal seeds; *: over the {} in which both succeeded. p: Wilcoxon's "
        "signed-rank "
        "test.",
        Plural(task.complete, "pair"), Plural(success.pairs.both, "pair"));
  }
  return fmt::format(
      "Means over {} of the baseline and {} of the run; *: over their {} and {} successes. p: Mann-Whitney's "
      "test.",
      Plural(task.baseline_complete, "episode"), task.complete, success.baseline_successes,
      success.successes);
}

std::string EqualTitle(const TaskComparison& task) {
  return task.paired ? "equal in each pair (means)" : "equal in all episodes";
}

std::string DifferenceInPoints(const SuccessComparison& success) {
  return PointsOf(success, success.difference);
}

std::pair<std::string, std::string> BoundsInPoints(const SuccessComparison& success) {
  const Points points(success);
  return {points.Text(success.difference_95.lower), points.Text(success.difference_95.upper)};
}

std::string DifferenceText(const SuccessComparison& success) {
  const auto [lower, upper] = BoundsInPoints(success);
  return fmt::format("{} points ({} to {})", DifferenceInPoints(success), lower, upper);
}

std::string Headline(const Comparison& comparison) {
  const SuccessComparison& success = comparison.success;
  const std::string &run = comparison.run.name, &baseline = comparison.baseline.name;
  if (!success.has_both_sides()) {
    if (HasVerdicts(comparison, &SuccessCounts::trials) &&
        HasVerdicts(comparison, &SuccessCounts::baseline_trials))
      return "No conclusion: no task has episodes with a verdict on both sides";
    if (success.paired) return "No conclusion: no pair of episodes has a verdict on both sides";
    if (!HasComplete(comparison, &TaskComparison::complete) &&
        !HasComplete(comparison, &TaskComparison::baseline_complete))
      return fmt::format("No conclusion: neither {} nor {} has a complete episode", run, baseline);
    const auto side = success.trials == 0 ? &TaskComparison::complete : &TaskComparison::baseline_complete;
    return fmt::format("No conclusion: {} has no complete episode{}", success.trials == 0 ? run : baseline,
                       HasComplete(comparison, side) ? " with a verdict" : "");
  }
  const auto [lower, upper] = BoundsInPoints(success);
  const std::string interval = fmt::format("95 % CI {} to {}", lower, upper);
  if (!success.is_shown) {
    // The interval is approximate and not adjusted, so it can exclude 0 although the test shows no
    // difference.
    const std::string tasks = TasksThatDiffer(comparison);
    return fmt::format("No difference shown between {} and {}{}: {} points, {}{}{}", run, baseline,
                       tasks.empty() ? "" : " over all tasks", DifferenceInPoints(success), interval,
                       success.difference_95.excludes_0() ? ", but " + PEquals(success.p_adjusted) : "",
                       tasks.empty() ? "" : "; " + tasks);
  }
  return fmt::format("{} is {} points {} than {}, {}", run, PointsOf(success, std::abs(success.difference)),
                     success.difference > 0 ? "better" : "worse", baseline, interval);
}

std::string Headline(const std::vector<Comparison>& comparisons) {
  if (comparisons.empty()) return "";
  if (comparisons.size() == 1) return Headline(comparisons.front());
  const std::string& baseline = comparisons.front().baseline.name;
  std::vector<std::string> parts, without_episode, without_verdict;
  for (const Comparison& comparison : comparisons) {
    const SuccessComparison& success = comparison.success;
    // If paired, both sides have the same number of trials, so this does not concern the baseline alone.
    if (!HasVerdicts(comparison, &SuccessCounts::baseline_trials) && !success.paired)
      return Headline(comparison);
    if (success.trials > 0) continue;
    const bool has_complete = HasComplete(comparison, &TaskComparison::complete);
    (has_complete ? without_verdict : without_episode).push_back(comparison.run.name);
  }
  const auto add = [&](Judgment judgment, const char* one, const char* several) {
    std::vector<std::string> names;
    for (const Comparison& comparison : comparisons) {
      const SuccessComparison& success = comparison.success;
      if (success.trials == 0 || success.judgment() != judgment) continue;
      names.push_back(comparison.run.name);
      if (judgment != Judgment::kNone) continue;
      if (const std::string tasks = TasksThatDiffer(comparison); !tasks.empty())
        names.back() += " (" + tasks + ")";
    }
    if (names.empty()) return;
    parts.push_back(fmt::format("{} {} {}", Enumerated(names), names.size() == 1 ? one : several, baseline));
  };
  add(Judgment::kBetter, "is better than", "are better than");
  add(Judgment::kWorse, "is worse than", "are worse than");
  add(Judgment::kNone, "is not shown to differ from", "are not shown to differ from");
  if (!without_episode.empty()) {
    parts.push_back(fmt::format("{} {} no complete episode", Enumerated(without_episode),
                                without_episode.size() == 1 ? "has" : "have"));
  }
  if (!without_verdict.empty()) {
    parts.push_back(fmt::format("{} {} no verdict to compare", Enumerated(without_verdict),
                                without_verdict.size() == 1 ? "has" : "have"));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::string Evidence(const Comparison& comparison) {
  const SuccessComparison& success = comparison.success;
  const std::string &run = comparison.run.name, &baseline = comparison.baseline.name;
  std::string text;
  if (const TaskComparison& task = comparison.tasks[0]; task.variation != task.baseline_variation) {
    text = fmt::format(
        "These are two variations: {} ran {}/{} and {} ran {}/{}, so a difference may come from the "
        "variation. ",
        run, task.task, task.variation, baseline, task.task, task.baseline_variation);
  }
  if (!success.has_both_sides()) return text;
  std::string test = TestName(success.test);
  // This applies even if adjusting did not change p, as for the largest p of a family.
  if (success.family > 1) {
    test += success.test == SuccessTest::kSequentialMcNemar ? ", adjusted with Bonferroni's method,"
                                                            : ", adjusted with Holm's method,";
  }
  text += fmt::format("{} of {} against {} of {}{}, {} {}.", success.successes, success.trials,
                      success.baseline_successes, success.baseline_trials,
                      success.paired ? " on the same seeds" : "", test, PEquals(success.p_adjusted));
  const bool has_outlook = !success.is_shown && success.test != SuccessTest::kSequentialMcNemar;
  return has_outlook ? text + " " + OutlookText(success) : text;
}

std::string Conclusion(const Comparison& comparison) {
  const std::string evidence = Evidence(comparison);
  return Headline(comparison) + "." + (evidence.empty() ? "" : " " + evidence);
}

}  // namespace evalbus::results
