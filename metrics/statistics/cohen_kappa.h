// Agreement of two raters on success and failure, corrected for the agreement expected by chance. Source:
// Cohen 1960, "A coefficient of agreement for nominal scales", Educational and Psychological Measurement 20.
#pragma once

#include <cstdint>
#include <optional>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// kappa = (p_o - p_e) / (1 - p_e): p_o is the share of episodes with equal verdicts, p_e the share expected
// if the raters were independent with their own rates of success. 1 means that the verdicts are always equal,
// 0 that they agree as often as by chance. nullopt without episodes, or if both raters gave the same verdict
// to all episodes, because p_e is then 1.
inline std::optional<double> CohenKappa(const PairCounts& verdicts) {
  const int64_t n = verdicts.pairs(), a = verdicts.successes_a(), b = verdicts.successes_b();
  // p_o and p_e, each multiplied by n squared to make it a whole number.
  const int64_t observed = n * (verdicts.both + verdicts.neither);
  const int64_t expected = a * b + (n - a) * (n - b);
  if (expected == n * n) return std::nullopt;
  return static_cast<double>(observed - expected) / static_cast<double>(n * n - expected);
}

}  // namespace evalbus::metrics
