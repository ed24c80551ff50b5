#include "report/web/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "base/errors.h"
#include "report/page/page.h"
#include "results/comparison.h"
#include "results/ranking.h"
#include "results/tally.h"
#include "viz/viewer/block.h"

namespace evalbus::report {
namespace {

using nlohmann::ordered_json;
using results::RecordedRun;

// A row of the board.
struct Policy {
  std::string name;
  // One run per task. The finished shards of a run are merged.
  results::RecordedRuns runs;
  std::vector<int> numbers;
  // Number of finished episodes of each of the runs in `numbers`.
  std::vector<size_t> done{};
  int planned = 0;
  // Number of planned episodes whose shards have not been found.
  int missing = 0;
  bool is_over = true;
};

// Returns the names of the policies that have evaluated the same task in more than one of the user's folders.
std::set<std::string> PoliciesInSeveralSources(const std::vector<BoardRun>& runs) {
  std::map<std::pair<std::string, std::string>, std::string> source_of;
  std::set<std::string> names;
  for (const BoardRun& run : runs) {
    const auto [entry, is_new] = source_of.emplace(std::pair(run.policy, run.run->task_name()), run.source);
    if (!is_new && entry->second != run.source) names.insert(run.policy);
  }
  return names;
}

void AddRun(const BoardRun& run, Policy* policy) {
  policy->numbers.push_back(run.number);
  policy->done.push_back(run.run->episodes.size());
  policy->is_over = policy->is_over && run.is_over;
  const int own = run.run->num_planned();
  auto same = std::ranges::find(policy->runs.runs, run.run->task_name(), &RecordedRun::task_name);
  const bool is_first = same == policy->runs.runs.end();
  const bool is_part = run.run->is_part() && run.planned > 0;
  policy->planned += !is_part ? own : is_first ? run.planned : 0;
  if (is_part) policy->missing += (is_first ? run.planned : 0) - own;
  if (is_first) {
    policy->runs.runs.push_back(*run.run);
    policy->runs.runs.back().name = policy->name;
    return;
  }
  same->episodes.insert(same->episodes.end(), run.run->episodes.begin(), run.run->episodes.end());
  std::ranges::sort(same->episodes, {}, &results::RecordedEpisode::episode);
}

std::vector<Policy> PoliciesOf(const std::vector<BoardRun>& runs) {
  const std::set<std::string> ambiguous = PoliciesInSeveralSources(runs);
  std::vector<Policy> policies;
  for (const BoardRun& run : runs) {
    const std::string name =
        ambiguous.contains(run.policy) ? fmt::format("{} ({})", run.policy, run.source) : run.policy;
    auto policy = std::ranges::find(policies, name, &Policy::name);
    if (policy == policies.end()) {
      policies.push_back({.name = name, .runs = {}, .numbers = {}});
      policies.back().runs.name = name;
      policy = std::prev(policies.end());
    }
    AddRun(run, &*policy);
  }
  for (Policy& policy : policies) policy.is_over = policy.is_over && policy.missing == 0;
  return policies;
}

ordered_json Counted(const metrics::RunSummary& summary, bool is_over) {
  const metrics::Interval& interval = is_over ? summary.wilson : summary.anytime;
  const metrics::MetricSummary* time = summary.Find("completion_time");
  ordered_json json = {{"done", summary.episodes},
                       {"complete", summary.complete},
                       {"judged", summary.judged},
                       {"successes", summary.successes},
                       {"rate", viz::NumberOrNull(summary.success_rate)},
                       {"interval", nullptr},
                       {"time_s", nullptr}};
  if (summary.judged > 0) json["interval"] = {interval.lower, interval.upper};
  if (std::string samples = summary.SamplesText(); !samples.empty()) json["samples"] = std::move(samples);
  if (time) json["time_s"] = time->mean;
  return json;
}

// Returns the mean number of slips of the complete episodes; null if none has this number. Slips are not
// divided by grasps: contact with one pad counts as holding for a slip, but not as a grasp.
ordered_json SlipsPerEpisode(const results::RecordedRuns& runs) {
  double slips = 0;
  int episodes = 0;
  for (const RecordedRun& run : runs.runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      if (!episode.complete) continue;
      for (const auto& [name, value] : episode.values) {
        if (name != "slip_count") continue;
        slips += value;
        ++episodes;
      }
    }
  }
  return episodes > 0 ? ordered_json(slips / episodes) : ordered_json();
}

ordered_json Stages(const metrics::RunSummary& summary) {
  ordered_json stages = ordered_json::array();
  for (const metrics::StageSummary& stage : summary.stages) {
    stages.push_back({stage.index, stage.reached});
  }
  return stages;
}

bool HasJudged(const Policy& policy) {
  return std::ranges::any_of(policy.runs.runs, [](const RecordedRun& run) {
    return std::ranges::any_of(run.episodes,
                               [](const auto& episode) { return episode.complete && episode.judged(); });
  });
}

// Comparison of a policy with the baseline. If there is none, remark states the reason; it is empty for the
// baseline and for policies without a judged episode.
struct WithBaseline {
  std::optional<results::Comparison> comparison;
  std::string remark;
};

std::vector<WithBaseline> CompareWithBaseline(const std::vector<Policy>& policies, size_t baseline) {
  std::vector<WithBaseline> compared(policies.size());
  std::vector<results::SuccessComparison*> family;
  for (size_t i = 0; i < policies.size(); ++i) {
    if (i == baseline || !HasJudged(policies[i]) || !HasJudged(policies[baseline])) continue;
    try {
      compared[i].comparison = results::CompareVerdicts(policies[i].runs, policies[baseline].runs);
      family.push_back(&compared[i].comparison->success);
    } catch (const InputError& error) {
      compared[i].remark = error.what();
    }
  }
  results::AdjustByHolm(family);
  return compared;
}

ordered_json Against(const WithBaseline& compared, bool is_final) {
  if (!compared.remark.empty()) return {{"remark", compared.remark}};
  if (!compared.comparison) return nullptr;
  const results::SuccessComparison& success = compared.comparison->success;
  if (!success.has_both_sides()) return nullptr;
  return {{"difference", viz::NumberOrNull(success.difference)},
          {"interval",
           {viz::NumberOrNull(success.difference_95.lower), viz::NumberOrNull(success.difference_95.upper)}},
          {"paired", success.paired},
          {"trials", success.trials},
          {"p", is_final ? ordered_json(success.p_adjusted) : ordered_json()},
          {"is_adjusted", success.family > 1},
          {"judgment", is_final ? results::Word(success.judgment()) : ""}};
}

// Returns the result in one sentence; empty unless all policies could be compared with the baseline.
std::string VerdictOf(const std::vector<Policy>& policies, const std::vector<WithBaseline>& compared,
                      size_t baseline) {
  std::vector<const results::RecordedRuns*> all;
  std::vector<results::Comparison> comparisons;
  for (size_t i = 0; i < policies.size(); ++i) {
    all.push_back(&policies[i].runs);
    if (i == baseline) continue;
    if (!compared[i].comparison) return "";
    comparisons.push_back(*compared[i].comparison);
  }
  return WithMinus(results::RankingHeadline(results::OrderBySuccess(all), comparisons));
}

std::vector<std::string> TasksOf(const std::vector<Policy>& policies) {
  std::vector<std::string> tasks;
  for (const Policy& policy : policies) {
    for (const RecordedRun& run : policy.runs.runs) {
      if (std::ranges::find(tasks, run.task_name()) == tasks.end()) tasks.push_back(run.task_name());
    }
  }
  return tasks;
}

// Returns how many of the names are not the name of any run.
template <class NameOf>
int64_t CountOthers(const std::set<std::string>& names, const std::vector<BoardRun>& runs, NameOf name_of) {
  return std::ranges::count_if(
      names, [&](const std::string& name) { return std::ranges::find(runs, name, name_of) == runs.end(); });
}

ordered_json PolicyJson(const Policy& policy, const std::vector<std::string>& tasks) {
  ordered_json json = {{"name", policy.name},
                       {"runs", policy.numbers},
                       {"runs_done", policy.done},
                       {"planned", policy.planned},
                       {"is_over", policy.is_over}};
  ordered_json cells = ordered_json::array();
  results::Tally all;
  for (const std::string& task : tasks) {
    const auto run = std::ranges::find(policy.runs.runs, task, &RecordedRun::task_name);
    if (run == policy.runs.runs.end()) {
      cells.push_back(nullptr);
      continue;
    }
    const metrics::RunSummary summary = run->Statistics().Summary(false);
    cells.push_back(Counted(summary, policy.is_over));
    cells.back()["stages"] = Stages(summary);
    cells.back()["successes_without_stage"] = summary.successes_without_stage;
    all.Add(*run);
  }
  json["cells"] = std::move(cells);
  json["all"] = Counted(all.Summary(), policy.is_over);
  json["slips_per_episode"] = SlipsPerEpisode(policy.runs);
  return json;
}

}  // namespace

std::string BoardBlock(const std::vector<BoardRun>& runs, const BoardFacts& facts) {
  const std::vector<Policy> policies = PoliciesOf(runs);
  const std::vector<std::string> tasks = TasksOf(policies);
  const bool is_over = facts.waiting_runs == 0 && std::ranges::all_of(policies, &Policy::is_over);
  const auto named = std::ranges::find(policies, facts.baseline, &Policy::name);
  const auto baseline = named == policies.end() ? size_t{0} : static_cast<size_t>(named - policies.begin());
  const bool is_final = is_over && !facts.is_sequential;
  const std::vector<WithBaseline> compared = CompareWithBaseline(policies, baseline);

  viz::BlockWriter block("board");
  ordered_json& head = block.head();
  head["is_over"] = is_over;
  head["planned"] = facts.waiting_episodes;
  for (const Policy& policy : policies) head["planned"] = head["planned"].get<int>() + policy.planned;
  head["waiting_runs"] = facts.waiting_runs;
  head["num_policies"] = policies.size() + CountOthers(facts.policies, runs, &BoardRun::policy);
  head["num_tasks"] =
      tasks.size() + CountOthers(facts.tasks, runs, [](const BoardRun& run) { return run.run->task_name(); });
  head["is_sequential"] = facts.is_sequential;
  head["baseline"] = baseline;
  head["verdict"] = is_final ? VerdictOf(policies, compared, baseline) : "";
  head["tasks"] = ordered_json::array();
  for (const std::string& task : tasks) {
    std::map<int, std::string> names;
    for (const BoardRun& run : runs) {
      if (run.run->task_name() == task) names.insert(run.stage_names.begin(), run.stage_names.end());
    }
    ordered_json stages = ordered_json::array();
    for (const auto& [index, name] : names) stages.push_back({index, name});
    head["tasks"].push_back({{"name", task}, {"stage_names", std::move(stages)}});
  }
  head["policies"] = ordered_json::array();
  for (size_t i = 0; i < policies.size(); ++i) {
    head["policies"].push_back(PolicyJson(policies[i], tasks));
    head["policies"].back()["against"] = Against(compared[i], is_final);
  }
  return block.Bytes();
}

}  // namespace evalbus::report
