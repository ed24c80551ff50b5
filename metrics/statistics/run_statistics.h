// Statistics across the episodes of a run.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "evalbus/run_summary_t.hpp"
#include "lcmtypes/end_reason.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/wilson.h"

namespace evalbus::metrics {

// Numbers by their names, which are there as long as the program runs, once for all episodes.
using NamedNumbers = std::vector<std::pair<std::string_view, double>>;

// One finished episode.
struct EpisodeResult {
  // No tick missing, no sample refused.
  bool complete = false;
  // Not complete because the policy's server failed, which says nothing of the policy.
  bool invalid = false;
  bool success = false;
  // Empty on success.
  std::string failure_reason;
  // False where the source did not know what success or failure asks for: in no rate of success.
  bool judged() const { return failure_reason != end_reason::kNotJudged; }
  // Every number of the result by its name as in summary.json, but for success and reached stages.
  NamedNumbers values;
  // Index, and whether it was reached.
  std::vector<std::pair<int, bool>> stages;
  // By object; -1: not known.
  std::vector<int64_t> slips;
  // New collisions by geom of the scene, or by pair of the robot's ("left/hand + right/hand").
  std::map<std::string, int64_t> collisions;
  // What was drawn for its start; empty where nothing was, or where that is not known (a run of an older
  // evalbus, a recorded trajectory, a source).
  NamedNumbers parameters;

  // Equal in every number, those of the start included (RunSummary::samples).
  bool operator==(const EpisodeResult&) const = default;
};

// Number of samples that the complete episodes of one task (pointers to them) count as in intervals and
// tests: one where all are equal in every number, those of the start included: nothing was drawn, or the same
// each time, and the policy did the same each time, so another one adds no information. Where a single one
// differs, all count: equal numbers from different starts are different samples, and so are equal starts of a
// policy that does not do the same each time.
template <class Episodes>
int NumSamples(const Episodes& episodes) {
  const bool are_equal =
      std::ranges::all_of(episodes, [&](const auto* episode) { return *episode == **episodes.begin(); });
  return are_equal ? std::min(1, static_cast<int>(episodes.size())) : static_cast<int>(episodes.size());
}

// From a line of episodes.jsonl; from a message: metrics/episode/result_json.h. Throws InputError where a
// stage is no number, nlohmann's exceptions where a key is missing or of another type.
EpisodeResult ResultOf(const nlohmann::ordered_json& episode);

// For EpisodeResult::values: of `metrics` and `extended` of an episode's line.
NamedNumbers NumbersOf(const nlohmann::ordered_json& metrics, const nlohmann::ordered_json& extended);

// Numbers and booleans (as 0 and 1) of a result dictionary by their flattened keys
// ("cartesian_path_length.left"), in the dictionary's order; "extended" goes before those of that dictionary
// ("extended.min_clearance_m").
NamedNumbers FlattenedValues(const nlohmann::ordered_json& metrics, const std::string& before = "");

// Over the complete episodes that have the metric; of the completion time, over those that succeeded.
struct MetricSummary {
  std::string name;  // flattened
  int episodes = 0;
  double mean = 0;
  // Of the sample (n - 1); NaN for one episode, or where all are equal.
  double std = 0;
  double median = 0;
  // Percentiles.
  double p5 = 0, p95 = 0;
  double min = 0, max = 0;
  // Bootstrap interval of the mean (statistics/interval_of_mean.h); NaN for one episode, where all are equal,
  // or where it was not asked for.
  Interval mean_95{};
};

struct StageSummary {
  int index = 0;
  // Complete episodes that reached it.
  int reached = 0;
};

struct RunSummary {
  int episodes = 0;
  int complete = 0;
  // Of those that are not complete, the ones whose policy's server failed.
  int invalid = 0;
  // As how many the complete ones count in the intervals (NumSamples), of a suite added up over its tasks.
  // Rates and means are over all of them in any case.
  int samples = 0;
  // Of the complete ones, those with a verdict about success (EpisodeResult::judged), and those that
  // succeeded.
  int judged = 0;
  int successes = 0;
  // Of the judged ones; NaN without them.
  double success_rate = 0;
  // Of that rate among as many trials as there are samples. For one look when the run is over: wilson,
  // clopper_pearson; for looks while it goes on: anytime (statistics/confidence_sequence.h).
  Interval wilson{}, clopper_pearson{}, anytime{};
  std::vector<StageSummary> stages;
  // Of the complete episodes that did not succeed; most frequent first.
  std::vector<std::pair<std::string, int>> failure_reasons;
  // Totals by object, in the order of slip_count_per_object; -1: not known.
  std::vector<int64_t> slips_per_object;
  // Totals; most frequent first.
  std::vector<std::pair<std::string, int64_t>> collisions_per_geom;
  // By first appearance. Success and reached stages are no metrics here: they have their own members.
  std::vector<MetricSummary> metrics;

  const MetricSummary* Find(const std::string& metric) const;
  // A number of complete episodes, scaled to samples.
  double InSamples(int count) const;
  // What a reader of the intervals has to know; empty where every episode is a sample of its own.
  std::string SamplesText() const;
};

// Kept up to date episode by episode. A summary goes over all values so far: 0.1 to 0.6 ms per 1,000
// episodes.
class RunStatistics {
 public:
  // Of an episode that was run twice, the last result counts. task: a number for each task of a suite, whose
  // episodes are counted on.
  void Add(int episode, const EpisodeResult& result, int task = 0);
  // Every episode from 0 to the highest added is there.
  bool is_without_gap() const {
    return episodes_.empty() || episodes_.rbegin()->first + 1 == static_cast<int>(episodes_.size());
  }

  // With the bootstrap, which takes about a second for a thousand episodes, at the end of a run.
  RunSummary Summary(bool with_bootstrap) const;

 private:
  struct Entry {
    int task = 0;
    bool complete = false, invalid = false, success = false;
    std::string failure_reason;
    std::vector<std::pair<size_t, double>> values;  // index in names_
    std::vector<std::pair<int, bool>> stages;
    std::vector<int64_t> slips;
    std::map<std::string, int64_t> collisions;
    NamedNumbers parameters;
    // When it ended, whether it succeeded or not.
    double time_s = 0;
    bool operator==(const Entry&) const = default;
  };
  size_t Index(std::string_view name);

  std::map<int, Entry> episodes_;
  std::vector<std::string> names_;
  // Values of a metric, ascending when they are asked for: the same bits in whatever order episodes finish.
  class Values {
   public:
    void Add(double value) { values_.push_back(value); }
    void Remove(double value);
    const std::vector<double>& Ascending() const;

   private:
    mutable std::vector<double> values_;
    mutable size_t ascending_ = 0;  // so many are in order already
  };
  std::vector<Values> values_;
};

// RUN_SUMMARY: what of it is known while the run goes on.
run_summary_t SummaryMessage(const RunSummary& summary);
// Counts and success rate, with which summaries of runs and of suites begin.
nlohmann::ordered_json RatesJson(const RunSummary& summary);
// summary.json.
nlohmann::ordered_json SummaryJson(const std::string& task, const std::string& variation,
                                   const RunSummary& summary);

}  // namespace evalbus::metrics
