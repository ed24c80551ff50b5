// Compares the results of the same policies on several engines (versions of MuJoCo): which verdicts flip, at
// which stage episodes diverge, and whether the comparison of the policies depends on the engine. Has no side
// effects; certificate_text.h generates text and JSON.
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
  // One entry per policy; its `name` is the policy's name.
  std::vector<RecordedRuns> policies;
};

// A stage at which pairs of episodes diverge. This is the first stage in the task's order that was reached on
// only one of the two engines.
struct StageParting {
  // Name of the task, TASK/VARIATION.
  std::string task;
  int stage = 0;
  // pairs: number of pairs that diverge at this stage. only_reference: number of these pairs that reached the
  // stage on the reference only.
  int pairs = 0, only_reference = 0;
  // Seed of the first of these pairs.
  int64_t seed = 0;
};

// One policy on one engine, compared with its results on the reference, which is the first engine.
struct PolicyOnEngine {
  std::string policy, engine;
  // `run` has the results on this engine, `baseline` the results on the reference. p of success is adjusted
  // with Holm's method for all policies and engines.
  Comparison comparison;
  // Stages at which pairs diverge, ordered by task and stage.
  std::vector<StageParting> partings;
  // pairs: number of pairs of complete episodes. different: number of these pairs whose results differ in any
  // value.
  int pairs = 0, different = 0;

  int flipped() const { return comparison.success.pairs.only_a + comparison.success.pairs.only_b; }
};

// Two policies, compared on each engine.
struct PolicyPair {
  std::string policy, baseline;
  // One comparison per engine, in the order of the engines. p is adjusted with Holm's method for all pairs of
  // policies on the engine.
  std::vector<SuccessComparison> on_engine;

  // Returns true if one policy has the higher rate on one engine, and the other policy has it on another
  // engine.
  bool order_reverses() const;
  // Returns true if the engines disagree on whether one of the policies is better.
  bool verdict_changes() const;
};

struct Certificate {
  // The first engine is the reference.
  std::vector<std::string> engines;
  // Ordered by engine, then by policy. The reference is not included.
  std::vector<PolicyOnEngine> comparisons;
  std::vector<PolicyPair> pairs;

  // Returns true if no pair of policies changes its order or its verdict.
  bool ranking_survives() const;
};

// Compares all engines with the first engine; episodes are paired by seed. Throws InputError if there are
// fewer than two engines, and the errors of CompareRuns().
Certificate Certify(const std::vector<EngineResults>& engines);

}  // namespace evalbus::results
