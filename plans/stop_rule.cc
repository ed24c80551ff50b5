#include "plans/stop_rule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/text.h"
#include "metrics/statistics/chance_to_decide.h"
#include "results/comparison.h"
#include "results/comparison_text.h"
#include "results/run_reader.h"

namespace evalbus::plans {

using nlohmann::ordered_json;

namespace {

// Reads the runs of a policy, each with only its first `episodes` episodes.
results::RecordedRuns ReadFirst(const PlanFolder& folder, const std::string& policy, int episodes) {
  results::RecordedRuns runs = results::ReadRuns(folder.policy_folder(policy));
  for (results::RecordedRun& run : runs.runs) {
    std::erase_if(run.episodes,
                  [&](const results::RecordedEpisode& episode) { return episode.episode >= episodes; });
  }
  return runs;
}

}  // namespace

Stop LookAtDifference(const PlanFolder& folder, const std::string& policy, const Stop& before, int episodes) {
  const Until& until = *folder.plan().until;
  const auto num_comparisons = static_cast<double>(folder.plan().policies.size() - 1);
  const results::SuccessCounts counts =
      results::CompareVerdicts(ReadFirst(folder, policy, episodes),
                               ReadFirst(folder, folder.plan().baseline, episodes))
          .success.samples;
  const bool is_last = episodes >= until.max_episodes;
  Stop stop = before;
  stop.episodes = episodes;
  stop.success = {counts.pairs.only_a, counts.pairs.only_b};
  stop.progress = counts.ahead;
  stop.success_p = std::min(before.success_p, metrics::SequentialP(stop.success, std::nullopt, is_last));
  stop.p = until.on_progress ? std::min(before.p, metrics::SequentialP(stop.success, stop.progress, is_last))
                             : stop.success_p;
  stop.p_adjusted = std::min(1.0, stop.p * num_comparisons);
  stop.success_p_adjusted = std::min(1.0, stop.success_p * num_comparisons);
  stop.is_decided = stop.p_adjusted <= until.alpha;
  const int pairs = counts.pairs.pairs();
  const auto most = static_cast<int>(std::lround(static_cast<double>(pairs) * until.max_episodes / episodes));
  stop.is_hopeless = !stop.is_decided && !is_last &&
                     metrics::ChanceOfSequentialTest(
                         stop.success, until.on_progress ? std::optional(stop.progress) : std::nullopt, pairs,
                         most, until.alpha / num_comparisons) < metrics::kLeastChance;
  // With progress, both tests together have the error rate alpha, so success alone counts as decided only if
  // the comparison is decided.
  stop.is_success_decided = stop.is_decided && (!until.on_progress || stop.success_p_adjusted <= until.alpha);
  return stop;
}

std::string Stop::Text(const std::string& baseline, const Until& until) const {
  std::string counts = fmt::format("{} won and {} lost", Plural(success.a, "pair"), success.b);
  if (until.on_progress)
    counts += fmt::format(" by success; by progress, ahead in {} and behind in {}", progress.a, progress.b);
  counts += fmt::format("; {} at any look", results::PEquals(p_adjusted));
  if (is_hopeless) {
    return fmt::format(
        "not decided against {} after {} of {} episodes of each task, and the rest would decide it with a "
        "chance below {:.0f} %: {}",
        baseline, episodes, until.max_episodes, 100 * metrics::kLeastChance, counts);
  }
  if (!is_decided) {
    return fmt::format("not decided against {} after {} episodes of each task, the plan's maximum: {}",
                       baseline, until.max_episodes, counts);
  }
  const bool is_by_progress = until.on_progress && !is_success_decided;
  const metrics::Wins& wins = is_by_progress ? progress : success;
  return fmt::format("{} than {}{}, decided after {} of {} episodes of each task: {}",
                     wins.a > wins.b ? "better" : "worse", baseline,
                     is_by_progress ? " in progress (stages and time; success alone is not decided)" : "",
                     episodes, until.max_episodes, counts);
}

ordered_json Stop::Json(const std::string& policy, const std::string& baseline, const Until& until) const {
  return {{"policy", policy},
          {"episodes", episodes},
          {"only_policy", success.a},
          {"only_baseline", success.b},
          {"ahead_policy", progress.a},
          {"ahead_baseline", progress.b},
          {"p", p_adjusted},
          {"p_unadjusted", p},
          {"is_decided", is_decided},
          {"success_p", success_p_adjusted},
          {"success_p_unadjusted", success_p},
          {"is_success_decided", is_success_decided},
          {"is_hopeless", is_hopeless},
          {"text", Text(baseline, until)}};
}

WidthStop LookAtWidth(const PlanFolder& folder, const std::string& policy, int episodes) {
  WidthStop stop{.episodes = episodes, .widest = {0, 0}};
  const auto width = [](const metrics::Interval& interval) { return interval.upper - interval.lower; };
  for (const results::RecordedRun& run : ReadFirst(folder, policy, episodes).runs) {
    const metrics::Interval interval = run.Statistics().Summary(false).anytime;
    if (width(interval) > width(stop.widest)) stop.widest = interval;
  }
  stop.is_narrow = width(stop.widest) <= folder.plan().until->width;
  return stop;
}

std::string WidthStop::Text(const Until& until) const {
  return fmt::format("success {:.1f} to {:.1f} % (95 %, valid at any look) after {} of at most {} episodes{}",
                     100 * widest.lower, 100 * widest.upper, episodes, until.max_episodes,
                     is_narrow ? "" : ", wider than the plan asks for");
}

ordered_json WidthStop::Json(const std::string& policy, const Until& until) const {
  return {{"policy", policy},      {"episodes", episodes},   {"lower", widest.lower},
          {"upper", widest.upper}, {"is_narrow", is_narrow}, {"text", Text(until)}};
}

int NextLook(const Plan& plan, int episodes) {
  return std::min(episodes + plan.options.episodes, plan.until->max_episodes);
}

ordered_json StopsJson(const PlanFolder& folder) {
  const Plan& plan = folder.plan();
  const Until& until = *plan.until;
  std::map<std::string, ordered_json> stops;
  for (const PlannedPolicy& policy : plan.policies) {
    int episodes = plan.options.episodes;
    if (until.width) {
      WidthStop stop = LookAtWidth(folder, policy.name, episodes);
      while (!stop.has_ended(until))
        stop = LookAtWidth(folder, policy.name, episodes = NextLook(plan, episodes));
      stops[policy.name] = stop.Json(policy.name, until);
    } else if (policy.name != plan.baseline) {
      Stop stop = LookAtDifference(folder, policy.name, {}, episodes);
      while (!stop.has_ended(until))
        stop = LookAtDifference(folder, policy.name, stop, episodes = NextLook(plan, episodes));
      stops[policy.name] = stop.Json(policy.name, plan.baseline, until);
    }
  }
  ordered_json json = ordered_json::array();
  for (auto& [policy, stop] : stops) json.push_back(std::move(stop));
  return json;
}

}  // namespace evalbus::plans
