// Several policies in the order of their success, and which of them are shown to differ.
#pragma once

#include <string>
#include <vector>

#include "cli/results/run_reader.h"

namespace evalbus::results {

struct RankedRun {
  std::string name;
  int successes = 0, trials = 0;
  // Two that share a letter are not shown to differ (metrics/statistics/letters.h).
  std::string letters;
};

// Compares all with each other, p adjusted by Holm for all pairs: the probability that any two equal policies
// are separated is at most 5 %. Most successful first; empty for fewer than three. Throws as CompareRuns
// does.
std::vector<RankedRun> RankBySuccess(const std::vector<const RecordedRuns*>& runs);

// A table with a line that explains it; empty for none.
std::string RankingText(const std::vector<RankedRun>& ranking);
inline constexpr char kRankingNote[] =
    "Policies that share a letter are not shown to differ (all pairs tested, p adjusted by Holm).";

}  // namespace evalbus::results
