#include "results/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/text.h"
#include "metrics/statistics/noninferiority.h"
#include "results/comparison.h"
#include "results/gate_metric.h"

namespace evalbus::results {
namespace {

// Throws InputError if a property of a run makes the error rates of a gate invalid.
void CheckUsable(const RecordedRuns& runs) {
  for (const RecordedRun& run : runs.runs) {
    const auto refuse = [&](const std::string& why) { throw InputError(run.folder.string() + ": " + why); };
    if (!run.is_simulated()) refuse("not simulated by evalbus: a gate requires equal starts");
    if (run.is_collection())
      refuse("collected demonstrations: only successes were kept, so a gate cannot use them");
    if (const std::string until = run.info.value("until", ""); !until.empty()) {
      refuse(
          fmt::format("its plan stopped depending on its results (until: {}): a gate requires a fixed "
                      "number of episodes",
                      until));
    }
    if (std::ranges::none_of(run.episodes, &RecordedEpisode::complete)) refuse("no complete episode");
  }
}

// Returns true if the run was planned to contain the episode with this number and seed.
bool IsPlanned(const RecordedRun& run, int episode, int64_t seed) {
  return run.IsPlanned(episode) && run.seeds().OfEpisode(episode) == seed;
}

using EpisodesBySeed = std::map<int64_t, const RecordedEpisode*>;

EpisodesBySeed AllEpisodesBySeed(const RecordedRun& run) {
  EpisodesBySeed episodes;
  for (const RecordedEpisode& episode : run.episodes) episodes[episode.seed] = &episode;
  return episodes;
}

// Returns the number of episodes that both runs were planned to contain, and that neither has.
int CountMissingOnBothSides(const RecordedRun& run, const EpisodesBySeed& own, const RecordedRun& baseline,
                            const EpisodesBySeed& other) {
  // Runs that have all of their episodes are the usual case.
  if (own.size() >= static_cast<size_t>(run.num_planned()) ||
      other.size() >= static_cast<size_t>(baseline.num_planned()))
    return 0;
  int missing = 0;
  for (int episode = 0; episode < run.planned; ++episode) {
    const int64_t seed = run.seeds().OfEpisode(episode);
    missing += run.IsPlanned(episode) && IsPlanned(baseline, episode, seed) && !own.contains(seed) &&
               !other.contains(seed);
  }
  return missing;
}

// Adds the complete pairs of a task. Returns the number of pairs in which a side lacks a complete result
// although its run was planned to contain the episode.
int AddTaskPairs(const RecordedRun& run, const RecordedRun& baseline, EpisodePairs* pairs) {
  const EpisodesBySeed own = AllEpisodesBySeed(run), other = AllEpisodesBySeed(baseline);
  int missing = CountMissingOnBothSides(run, own, baseline, other);
  for (const auto& [seed, episode] : own) {
    const auto found = other.find(seed);
    if (found == other.end()) {
      missing += IsPlanned(baseline, episode->episode, seed);
    } else if (episode->complete && found->second->complete) {
      pairs->push_back({episode, found->second});
    } else {
      ++missing;
    }
  }
  for (const auto& [seed, episode] : other) {
    if (!own.contains(seed)) missing += IsPlanned(run, episode->episode, seed);
  }
  return missing;
}

const RecordedRun& FindRun(const RecordedRuns& runs, const std::filesystem::path& folder) {
  return *std::ranges::find(runs.runs, folder, &RecordedRun::folder);
}

// Returns the reason why the run cannot pass; empty if there is none.
std::string Objection(const Comparison& comparison, const GateOptions& options) {
  if (!options.has_commanded_motion) {
    return fmt::format("no log of {} shows that the policy commanded a motion", comparison.run.name);
  }
  if (comparison.success.successes == 0) {
    return fmt::format("{} succeeded in none of {}", comparison.run.name,
                       Plural(comparison.success.trials, "episode"));
  }
  return "";
}

// Decides on success. Missing pairs count against the verdict: the test for PASS counts them as lost, the
// test for FAIL as gained.
GateCriterion DecideSuccess(const SuccessComparison& success, int missing, double margin_points,
                            double fail_alpha) {
  const metrics::PairCounts& counts = success.samples.pairs;
  const double margin = margin_points / 100;
  const auto test = [&](int lost, int gained, double difference, double alpha) {
    return metrics::TestPairedAbove({counts.pairs() + missing, counts.only_a + gained, counts.only_b + lost},
                                    difference, alpha);
  };
  const metrics::PairedAbove no_loss = test(missing, 0, -margin, metrics::kAlpha);
  const metrics::PairedAbove loss = metrics::TestPairedAbove(
      metrics::Discordant{counts.pairs() + missing, counts.only_a + missing, counts.only_b}.swapped(), margin,
      fail_alpha);
  GateCriterion result{.what = "success",
                       .verdict = no_loss.is_above ? GateVerdict::kPass
                                  : loss.is_above  ? GateVerdict::kFail
                                                   : GateVerdict::kCannotTell,
                       .pairs = success.trials,
                       .pairs_are_successes = false,
                       .baseline_mean = 100.0 * success.baseline_successes / success.baseline_trials,
                       .mean = 100.0 * success.successes / success.trials,
                       .mean_unit = "%",
                       .loss = -100 * success.difference,
                       .loss_lower = 100 * loss.lower,
                       .loss_upper = -100 * no_loss.lower,
                       .margin = margin_points,
                       .unit = "points",
                       .fail_alpha = fail_alpha,
                       .more_pairs = std::nullopt,
                       .why = ""};
  if (result.verdict == GateVerdict::kCannotTell && counts.pairs() > 1 && missing == 0) {
    const double n = counts.pairs();
    const metrics::DiscordantShares shares{counts.only_a / n, counts.only_b / n};
    auto needed = metrics::PairsNeeded(shares, -margin, metrics::kAlpha);
    if (!needed) needed = metrics::PairsNeeded({shares.only_b, shares.only_a}, margin, fail_alpha);
    if (needed) result.more_pairs = std::max(1, *needed - counts.pairs());
  }
  return result;
}

void Conclude(Gate* gate) {
  for (const GateVerdict verdict : {GateVerdict::kFail, GateVerdict::kCannotTell, GateVerdict::kPass}) {
    const auto decisive = std::ranges::find(gate->criteria, verdict, &GateCriterion::verdict);
    if (decisive == gate->criteria.end()) continue;
    gate->verdict = verdict;
    gate->why = decisive->why;
    return;
  }
}

}  // namespace

const char* Word(GateVerdict verdict) {
  switch (verdict) {
    case GateVerdict::kPass:
      return "PASS";
    case GateVerdict::kFail:
      return "FAIL";
    case GateVerdict::kCannotTell:
      break;
  }
  return "CANNOT TELL";
}

Gate Decide(const RecordedRuns& run, const RecordedRuns& baseline, const GateOptions& options) {
  CheckUsable(run);
  CheckUsable(baseline);
  const Comparison comparison = CompareVerdicts(run, baseline);
  std::set<std::string> compared;
  for (const TaskComparison& task : comparison.tasks) {
    if (!task.paired)
      throw InputError(task.name() + ": no seed in common; run both with the same --seed and task");
    compared.insert(task.name());
  }
  for (const RecordedRun& other : baseline.runs) {
    if (!compared.contains(other.task_name()))
      throw InputError(fmt::format("{} is not in {}: a gate requires all tasks of the baseline",
                                   other.task_name(), run.name));
  }
  if (!baseline.missing.empty())
    throw InputError(fmt::format("{}/{} has no finished episode: a gate requires all tasks of the baseline",
                                 baseline.name, baseline.missing.front()));
  if (comparison.success.trials == 0) throw InputError("no pair of complete episodes with equal seeds");
  Gate gate{.run = comparison.run.name,
            .baseline = comparison.baseline.name,
            .verdict = GateVerdict::kCannotTell,
            .why = "",
            .criteria = {},
            .tasks = {},
            .remarks = comparison.remarks};
  EpisodePairs pairs;
  int missing = 0;
  for (const TaskComparison& task : comparison.tasks) {
    const size_t before = pairs.size();
    missing += AddTaskPairs(FindRun(run, task.folder), FindRun(baseline, task.baseline_folder), &pairs);
    // Keeps one pair if all episodes are equal and count as one sample (metrics::NumSamples).
    if (task.success.samples.trials < task.success.trials) pairs.resize(before + 1);
    gate.tasks.push_back({.name = task.name(),
                          .pairs = task.success.trials,
                          .successes = task.success.successes,
                          .baseline_successes = task.success.baseline_successes,
                          .gained = task.success.pairs.only_a,
                          .lost = task.success.pairs.only_b});
  }
  const std::vector<GateMetric> metrics = ParseGateMetrics(options.on, options.margin, pairs);
  // PASS requires all criteria to pass. A single failed criterion suffices for FAIL, so its alpha is divided
  // by their number.
  const double fail_alpha = metrics::kAlpha / static_cast<double>(metrics.size() + 1);
  gate.criteria.push_back(DecideSuccess(comparison.success, missing, options.margin.value, fail_alpha));
  for (const GateMetric& metric : metrics) gate.criteria.push_back(DecideMetric(metric, pairs, fail_alpha));
  for (GateCriterion& criterion : gate.criteria) {
    criterion.why = WhyText(criterion);
    if (missing == 0 || criterion.what == "success" || criterion.verdict != GateVerdict::kPass) continue;
    criterion.verdict = GateVerdict::kCannotTell;
    criterion.why += fmt::format("; unknown for {} without a complete result", Plural(missing, "pair"));
  }
  if (const std::string objection = Objection(comparison, options);
      !objection.empty() && gate.criteria[0].verdict != GateVerdict::kFail) {
    gate.criteria[0].verdict = GateVerdict::kCannotTell;
    gate.criteria[0].why = objection + "; such a run cannot pass";
  }
  if (missing > 0) {
    gate.remarks.push_back(
        fmt::format("{} without a complete result on at least one side: for success they count against the "
                    "verdict, and metrics "
                    "cannot pass; --resume runs unfinished and invalid episodes of a "
                    "run again",
                    Plural(missing, "pair")));
  }
  Conclude(&gate);
  return gate;
}

}  // namespace evalbus::results
