// Ranks policies by success, and determines which policies differ significantly.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "results/comparison.h"
#include "results/run_reader.h"

namespace evalbus::results {

struct RankedRun {
  std::string name;
  int successes = 0, trials = 0;
  // Policies that share a letter do not differ significantly (metrics/statistics/letters.h).
  std::string letters;
};

// Returns the counts of the policies, ordered by descending success, without letters. Policies without an
// episode that has a verdict are last. The result is empty for fewer than three policies, and if the policies
// did not all run the same tasks.
std::vector<RankedRun> OrderBySuccess(const std::vector<const RecordedRuns*>& runs);

// Returns the result of OrderBySuccess() with letters. Compares all pairs of runs; p is adjusted with Holm's
// method for all pairs. The probability that any two equal policies are reported as different is therefore
// at most 5 %. Throws the errors of CompareRuns().
std::vector<RankedRun> RankBySuccess(const std::vector<const RecordedRuns*>& runs);

// Returns the rates of up to six policies in their order, and the results of the comparisons with the
// baseline, for example "a 90 %, b 56 %, c 52 %; b and c are worse than a". For an empty ranking or more
// policies, returns only the results.
std::string RankingHeadline(const std::vector<RankedRun>& ranking,
                            const std::vector<Comparison>& comparisons);
// Returns a table and a sentence that explains it, wrapped at `width`; empty for an empty ranking.
std::string RankingText(const std::vector<RankedRun>& ranking, int width = std::numeric_limits<int>::max());
// Explains the letters and, if the policies have different numbers of episodes, the rates.
std::string RankingNote(const std::vector<RankedRun>& ranking);

}  // namespace evalbus::results
