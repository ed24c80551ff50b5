// Compares what the same policies achieve on several engines (versions of MuJoCo): which verdicts flip, at
// which stage episodes diverge, and whether the comparison of the policies depends on the engine. Pure: text
// and JSON are generated elsewhere (certificate_text.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "results/comparison.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Results on one engine. All engines have the same policies, in the same order.
struct EngineResults {
  // Version of MuJoCo, for example "3.3.3".
  std::string engine;
  // By policy; `name` is the policy's name.
  std::vector<RecordedRuns> policies;
};

// A stage at which pairs of episodes diverge: the first one in the task's order that was reached on only one
// of the two engines.
struct StageParting {
  // TASK/VARIATION.
  std::string task;
  int stage = 0;
  // Number of pairs that diverge at this stage; of these, the number that reached it on the reference only.
  int pairs = 0, only_reference = 0;
  // The first of these pairs.
  int64_t seed = 0;
};

// One policy on one engine, compared with the reference: the first engine.
struct PolicyOnEngine {
  std::string policy, engine;
  // run: on this engine, baseline: on the reference. p of success is adjusted by Holm for all policies and
  // engines.
  Comparison comparison;
  // Ordered by task and stage.
  std::vector<StageParting> partings;
  // Number of pairs of episodes, and of pairs whose results differ in any value.
  int pairs = 0, different = 0;

  int flipped() const { return comparison.success.pairs.only_a + comparison.success.pairs.only_b; }
};

// Two policies, compared on each engine.
struct PolicyPair {
  std::string policy, baseline;
  // In the order of the engines. p is adjusted by Holm for all pairs of policies on the engine.
  std::vector<SuccessComparison> on_engine;

  // True if one policy has the higher rate on one engine, and the other policy on another.
  bool order_reverses() const;
  // True if the engines disagree on whether one of them is better.
  bool verdict_changes() const;
};

struct Certificate {
  // The first one is the reference.
  std::vector<std::string> engines;
  // Ordered by engine, without the reference, and policy.
  std::vector<PolicyOnEngine> comparisons;
  std::vector<PolicyPair> pairs;

  // True if no pair of policies changes its order or its verdict.
  bool ranking_survives() const;
};

// Compares all engines with the first one, paired by seed. Throws InputError if there are fewer than two
// engines, and as CompareRuns() does.
Certificate Certify(const std::vector<EngineResults>& engines);

}  // namespace evalbus::results
