#include "results/ranking.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "base/help.h"
#include "base/text.h"
#include "metrics/statistics/letters.h"
#include "results/conclusion.h"

namespace evalbus::results {
namespace {

// Maximum number of policies whose rates are in a headline.
constexpr size_t kMaxInOrder = 6;

std::string Rate(const RankedRun& run) {
  return run.trials > 0 ? Percent(static_cast<double>(run.successes) / run.trials) : "–";
}

struct Ordered {
  RankedRun counts;
  const RecordedRuns* run;
};

std::vector<Ordered> InOrder(const std::vector<const RecordedRuns*>& runs) {
  const auto tasks = [](const RecordedRuns& of) {
    std::set<std::string> names;
    for (const RecordedRun& run : of.runs) names.insert(run.task_name());
    return names;
  };
  if (runs.size() < 3) return {};
  // Rates over different tasks have no order.
  for (const RecordedRuns* run : runs) {
    if (tasks(*run) != tasks(*runs[0])) return {};
  }
  std::vector<Ordered> result;
  for (const RecordedRuns* run : runs) {
    RankedRun counts{.name = run->name, .letters = {}};
    for (const RecordedRun& task : run->runs) {
      const metrics::RunSummary summary = task.Statistics().Summary(false);
      counts.successes += summary.successes;
      counts.trials += summary.judged;
    }
    result.push_back({counts, run});
  }
  std::ranges::stable_sort(result, [](const Ordered& a, const Ordered& b) {
    // A policy without trials has no rate and comes last.
    if (a.counts.trials == 0 || b.counts.trials == 0) return a.counts.trials > 0 && b.counts.trials == 0;
    return int64_t{a.counts.successes} * b.counts.trials > int64_t{b.counts.successes} * a.counts.trials;
  });
  return result;
}

}  // namespace

std::vector<RankedRun> OrderBySuccess(const std::vector<const RecordedRuns*>& runs) {
  std::vector<RankedRun> result;
  for (const Ordered& ordered : InOrder(runs)) result.push_back(ordered.counts);
  return result;
}

std::vector<RankedRun> RankBySuccess(const std::vector<const RecordedRuns*>& runs) {
  std::vector<RankedRun> result;
  std::vector<const RecordedRuns*> in_order;
  for (const Ordered& ordered : InOrder(runs)) {
    result.push_back(ordered.counts);
    in_order.push_back(ordered.run);
  }
  const std::vector<SuccessComparison> pairs = CompareEachPair(in_order);
  std::vector<std::vector<bool>> differs(result.size(), std::vector<bool>(result.size()));
  auto next = pairs.begin();
  for (size_t i = 0; i < result.size(); ++i) {
    for (size_t j = i + 1; j < result.size(); ++j) differs[i][j] = differs[j][i] = next++->is_shown;
  }
  const std::vector<std::string> letters = metrics::CompactLetters(differs);
  for (size_t i = 0; i < result.size(); ++i) result[i].letters = letters[i];
  return result;
}

std::string RankingHeadline(const std::vector<RankedRun>& ranking,
                            const std::vector<Comparison>& comparisons) {
  if (ranking.empty() || ranking.size() > kMaxInOrder) return Headline(comparisons);
  std::vector<std::string> rates;
  for (const RankedRun& run : ranking) rates.push_back(run.name + " " + Rate(run));
  return fmt::format("{}; {}", fmt::join(rates, ", "), Headline(comparisons));
}

std::string RankingNote(const std::vector<RankedRun>& ranking) {
  std::string note =
      "Policies that share a letter do not differ significantly (all pairs tested, p adjusted with Holm's "
      "method, which is stricter than comparisons with the baseline only).";
  const auto has_other_trials = [&](const RankedRun& run) { return run.trials != ranking.front().trials; };
  if (std::ranges::any_of(ranking, has_other_trials)) {
    note +=
        " Rates cover all episodes of a policy; comparisons and letters cover the starts that two policies "
        "have in common.";
  }
  return note;
}

std::string RankingText(const std::vector<RankedRun>& ranking, int width) {
  if (ranking.empty()) return "";
  size_t longest = 0;
  for (const RankedRun& run : ranking) longest = std::max(longest, run.name.size());
  std::string text = "Ranking by success\n";
  for (const RankedRun& run : ranking) {
    text += fmt::format("{}  {:>14}  {:>5}  {}\n", Pad(run.name, -static_cast<int>(longest)),
                        fmt::format("{} of {}", run.successes, run.trials), Rate(run), run.letters);
  }
  return text + Wrapped(RankingNote(ranking), 0, static_cast<size_t>(width)) + "\n";
}

}  // namespace evalbus::results
