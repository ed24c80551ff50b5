// Statistics of the verdicts of operators: success rates, agreement with the automatic verdicts, and the
// difference between two runs.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/run_statistics.h"
#include "results/comparison.h"
#include "results/run_reader.h"
#include "results/verdicts.h"

namespace evalbus::results {

// Verdicts of one operator on one run.
struct OperatorResult {
  std::string operator_name;
  int abstentions = 0;
  // Success rate over the episodes that the operator judged as success or failure, including incomplete
  // episodes.
  metrics::RunSummary rates;
  // Counts over the episodes that also have an automatic verdict. a: the operator, b: the automatic verdict.
  metrics::PairCounts agreement;
  // Cohen's kappa; nullopt if it is undefined (metrics::CohenKappa).
  std::optional<double> kappa;
  // Means over the episodes for which the operator gave these values; nullopt if there are none.
  std::optional<double> mean_stages, mean_rubric;
};

// Also throws InputError if a verdict is on an episode that the run does not have.
std::vector<Verdict> ReadVerdictsOf(const RecordedRun& run);

// A run and its verdicts.
struct JudgedRun {
  RecordedRun run;
  std::vector<Verdict> verdicts;
};
// Throws InputError.
JudgedRun ReadJudgedRun(const std::filesystem::path& folder);

// Returns one result for each operator, in alphabetical order.
std::vector<OperatorResult> OperatorResults(const RecordedRun& run, const std::vector<Verdict>& verdicts);

// Compares run with baseline as `evalbus compare` does, by the verdicts of one operator instead of the
// automatic verdicts. Covers the pairs with equal seeds in which both episodes were judged as success or
// failure. Returns nullopt if there is no such pair. Throws InputError if the runs cannot be compared.
std::optional<Comparison> CompareByOperator(const JudgedRun& run, const JudgedRun& baseline,
                                            const std::string& operator_name);

// Returns the result as sentences. The first sentence names the operator.
std::vector<std::string> OperatorSentences(const OperatorResult& result);

// Results of one or two runs, as text (headings, each followed by indented sentences) and as JSON. If there
// are two runs, the first one is the baseline. Both functions throw InputError if the runs cannot be
// compared.
std::vector<std::string> JudgmentLines(const std::vector<JudgedRun>& runs);
nlohmann::ordered_json JudgmentJson(const std::vector<JudgedRun>& runs);

}  // namespace evalbus::results
