// Ranks policies by success, and determines which of them differ significantly.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

struct RankedRun {
  std::string name;
  int successes = 0, trials = 0;
  // Policies that share a letter do not differ significantly (metrics/statistics/letters.h).
  std::string letters;
};

// Compares all pairs of runs; p is adjusted with Holm's method for all pairs. The probability that any two
// equal policies are reported as different is therefore at most 5 %. The result is ordered by descending
// success. It is empty for fewer than three policies, and if not all of them ran the same tasks. Throws
// InputError whenever CompareRuns() does.
std::vector<RankedRun> RankBySuccess(const std::vector<const RecordedRuns*>& runs);

// Returns the order in one sentence, for example "a 90 % > b 56 % ≈ c 52 %; not shown to differ: b and c" or
// "a 90 % > b 56 % > c 20 %; all differ". With more than six policies, it names only the first: "a 90 %
// succeeds most often; 5 of 7 others are shown to be worse". Empty for an empty ranking.
std::string RankingHeadline(const std::vector<RankedRun>& ranking);
// Returns a table and a sentence that explains it, wrapped at `width`; empty for an empty ranking.
std::string RankingText(const std::vector<RankedRun>& ranking, int width = std::numeric_limits<int>::max());
inline constexpr char kRankingNote[] =
    "Policies that share a letter are not shown to differ (all pairs tested, p adjusted with Holm's method, "
    "which is stricter than comparisons with the baseline only).";

}  // namespace evalbus::results
