#include "results/certificate.h"

#include <algorithm>
#include <map>

#include "base/errors.h"

namespace evalbus::results {
namespace {

// Adds the pairs of one task to the counts and stages in `result`.
void AddPairs(const RecordedRun& run, const RecordedRun& reference, PolicyOnEngine* result) {
  std::map<int, StageParting> by_stage;
  for (const RecordedEpisode& episode : run.episodes) {
    const auto other = std::ranges::find(reference.episodes, episode.seed, &RecordedEpisode::seed);
    if (other == reference.episodes.end() || !episode.complete || !other->complete) continue;
    ++result->pairs;
    result->different += !(static_cast<const metrics::EpisodeResult&>(episode) == *other);
    // Both lists contain all stages of the task, in the task's order.
    const auto& reached = episode.stages;
    const auto& reached_there = other->stages;
    const auto [here, there] =
        std::mismatch(reached.begin(), reached.end(), reached_there.begin(), reached_there.end());
    if (here == reached.end() || there == reached_there.end()) continue;
    StageParting& parting = by_stage[here->first];
    if (parting.pairs++ == 0) {
      parting.task = run.task_name();
      parting.stage = here->first;
      parting.seed = episode.seed;
    }
    parting.only_reference += there->second;
  }
  for (const auto& [stage, parting] : by_stage) result->partings.push_back(parting);
}

PolicyOnEngine CompareWithReference(const EngineResults& engine, const EngineResults& reference,
                                    size_t policy) {
  // The runs are named after their engines, because text and JSON name the policy separately.
  RecordedRuns run = engine.policies[policy], baseline = reference.policies[policy];
  PolicyOnEngine result{.policy = run.name,
                        .engine = engine.engine,
                        .comparison = {},
                        .partings = {},
                        .pairs = 0,
                        .different = 0};
  run.name = engine.engine;
  baseline.name = reference.engine;
  // The versions are removed so that CompareVerdicts() does not remark that the engines differ.
  for (RecordedRun& one : run.runs) one.info.erase("mujoco_version");
  result.comparison = CompareVerdicts(run, baseline);
  for (const RecordedRun& one : run.runs) {
    const auto other = std::ranges::find_if(baseline.runs, [&](const RecordedRun& candidate) {
      return candidate.task_name() == one.task_name();
    });
    if (other != baseline.runs.end()) AddPairs(one, *other, &result);
  }
  return result;
}

std::vector<PolicyPair> PairsOfPolicies(const std::vector<EngineResults>& engines) {
  std::vector<PolicyPair> pairs;
  for (const EngineResults& engine : engines) {
    std::vector<const RecordedRuns*> policies;
    for (const RecordedRuns& policy : engine.policies) policies.push_back(&policy);
    const std::vector<SuccessComparison> compared = CompareEachPair(policies);
    auto next = compared.begin();
    size_t index = 0;
    for (size_t i = 0; i < policies.size(); ++i) {
      for (size_t j = i + 1; j < policies.size(); ++j, ++index) {
        if (index == pairs.size()) pairs.push_back({policies[i]->name, policies[j]->name, {}});
        pairs[index].on_engine.push_back(*next++);
      }
    }
  }
  return pairs;
}

}  // namespace

bool PolicyPair::order_reverses() const {
  const auto [least, most] = std::ranges::minmax_element(on_engine, {}, &SuccessComparison::difference);
  return least->difference < 0 && most->difference > 0;
}

bool PolicyPair::verdict_changes() const {
  return std::ranges::any_of(on_engine, [&](const SuccessComparison& success) {
    return success.judgment() != on_engine.front().judgment();
  });
}

bool Certificate::ranking_survives() const {
  return std::ranges::none_of(
      pairs, [](const PolicyPair& pair) { return pair.order_reverses() || pair.verdict_changes(); });
}

Certificate Certify(const std::vector<EngineResults>& engines) {
  if (engines.size() < 2) throw InputError("expected two or more engines");
  Certificate certificate;
  for (size_t i = 0; i < engines.size(); ++i) {
    certificate.engines.push_back(engines[i].engine);
    if (i == 0) continue;
    for (size_t policy = 0; policy < engines[0].policies.size(); ++policy) {
      certificate.comparisons.push_back(CompareWithReference(engines[i], engines[0], policy));
    }
  }
  std::vector<SuccessComparison*> family;
  for (auto& compared : certificate.comparisons) family.push_back(&compared.comparison.success);
  AdjustByHolm(family);
  certificate.pairs = PairsOfPolicies(engines);
  return certificate;
}

}  // namespace evalbus::results
