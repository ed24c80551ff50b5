// Ranks policies by success, and shows which of them differ significantly.
#pragma once

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

// Compares all pairs, with p adjusted by Holm for all pairs: the probability that any two equal policies are
// reported as different is at most 5 %. Ordered by descending success; empty for fewer than three policies.
// Throws as CompareRuns() does.
std::vector<RankedRun> RankBySuccess(const std::vector<const RecordedRuns*>& runs);

// The order in one sentence, for example "a 90 % > b 56 % ≈ c 52 %; not shown to differ: b and c" or
// "a 90 % > b 56 % > c 20 %; all differ". Of more than six policies, only the first: "a 90 % succeeds most
// often; 5 of 7 others are shown to be worse". Empty for an empty ranking.
std::string RankingHeadline(const std::vector<RankedRun>& ranking);
// Returns a table and a line that explains it; empty for an empty ranking.
std::string RankingText(const std::vector<RankedRun>& ranking);
inline constexpr char kRankingNote[] =
    "Policies that share a letter are not shown to differ (all pairs tested, p adjusted by Holm).";

}  // namespace evalbus::results
