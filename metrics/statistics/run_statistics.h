// Statistics across the episodes of a run.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "evalbus/run_summary_t.hpp"
#include "lcmtypes/end_reason.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/pose_repeatability.h"
#include "models/pose.h"

namespace evalbus::metrics {

// Numbers by name. The names are interned: stored once for all episodes, for the lifetime of the process.
using NamedNumbers = std::vector<std::pair<std::string_view, double>>;

// Poses by name ("left_wrist", "pot"). The names are interned.
using NamedPoses = std::vector<std::pair<std::string_view, Pose>>;

// Result of one finished episode.
struct EpisodeResult {
  // As in episode_summary_t.
  bool complete = false;
  // Incomplete because the policy's server failed, so that no conclusion about the policy can be drawn.
  bool invalid = false;
  bool success = false;
  // True if success or failure was decided at the first tick that can decide, tick 1.
  bool decided_at_start = false;
  // Reason of the failure; empty on success.
  std::string failure_reason;
  // Returns false if the source does not provide what the success or failure condition needs; such an episode
  // counts in no success rate.
  bool judged() const { return failure_reason != end_reason::kNotJudged; }
  // Every number of the result by its name as in summary.json, except success and reached stages.
  NamedNumbers values;
  // Index of each stage, and whether it was reached.
  std::vector<std::pair<int, bool>> stages = {};
  // Number of slips by object; -1: unknown.
  std::vector<int64_t> slips = {};
  // New collisions by scene geom, or by pair of robot geoms ("left/hand + right/hand").
  std::map<std::string, int64_t> collisions = {};
  // Randomized start parameters. Empty if nothing was randomized, or if the parameters are unknown (a run of
  // an older evalbus version, a recorded trajectory, an external source).
  NamedNumbers parameters;
  // True if the policy was trained on a demonstration with these start parameters; nullopt if its contract
  // does not name the demonstrations on which it was trained.
  std::optional<bool> seen_in_training = std::nullopt;
  // False if the parameters are unknown.
  bool is_start_known = false;
  // Poses of wrists and manipulated objects at the last tick that the values cover; empty in runs of older
  // versions.
  NamedPoses final_poses;

  // Returns the value with this name as in summary.json, if the episode has it.
  std::optional<double> Find(std::string_view name) const;
  // True if the results agree in every number, including the start parameters (see RunSummary::samples).
  bool operator==(const EpisodeResult&) const = default;
};

// Returns the effective number of samples in the complete episodes of one task, for intervals and tests.
// `episodes` holds pointers to the episodes. If all are equal in every number, including the start
// parameters, they count as one sample: the reset state was the same each time and the policy is
// deterministic, so another repetition adds no information. If any episode differs, every episode counts as a
// sample, because either the reset states differed or the policy is not deterministic.
template <class Episodes>
int NumSamples(const Episodes& episodes) {
  const bool are_equal =
      std::ranges::all_of(episodes, [&](const auto* episode) { return *episode == **episodes.begin(); });
  return are_equal ? std::min(1, static_cast<int>(episodes.size())) : static_cast<int>(episodes.size());
}

// Key of EpisodeResult::seen_in_training in episodes.jsonl, and of the count in summary.json.
inline constexpr char kSeenInTraining[] = "seen_in_training";
// Returns the value of the key "final_poses" of a line of episodes.jsonl.
nlohmann::ordered_json PosesJson(const NamedPoses& poses);

// Converts a line of episodes.jsonl; metrics/episode/result_json.h converts messages. Throws InputError if a
// stage index is not a number or the key of a slip count is unknown, and nlohmann's exceptions if a key is
// missing or has the wrong type.
EpisodeResult ResultOf(const nlohmann::ordered_json& episode);

// Collects EpisodeResult::values from `metrics` and `extended` of a line of episodes.jsonl.
NamedNumbers NumbersOf(const nlohmann::ordered_json& metrics, const nlohmann::ordered_json& extended);

// Returns the numbers and booleans (as 0 and 1) of a result dictionary by their flattened keys
// ("cartesian_path_length.left"), in the dictionary's order. before: prefix of the keys; "extended" for the
// extended metrics ("extended.min_clearance_m").
NamedNumbers FlattenedValues(const nlohmann::ordered_json& metrics, const std::string& before = "");

// Statistics of a metric over the complete episodes that have a value for it. For the completion time, only
// successful episodes count.
struct MetricSummary {
  std::string name;  // flattened: keys joined by dots
  int episodes = 0;
  double mean = 0;
  // Sample standard deviation (n - 1); NaN for one episode, or if all episodes are equal.
  double std = 0;
  double median = 0;
  // 5th and 95th percentile.
  double p5 = 0, p95 = 0;
  double min = 0, max = 0;
  // Interval of the mean (statistics/interval_of_mean.h), clipped to the metric's range. NaN for one episode,
  // if all values are equal, or if the interval was not requested.
  Interval mean_95{};
};

struct StageSummary {
  int index = 0;
  // Number of complete episodes that reached the stage.
  int reached = 0;
};

// Repeatability of the final poses of the successful episodes that began with these parameters.
struct StartRepeatability {
  NamedNumbers parameters;
  int episodes = 0;
  std::vector<std::pair<std::string_view, PoseRepeatability>> poses;
};

struct RunSummary {
  int episodes = 0;
  int complete = 0;
  // Number of incomplete episodes whose policy's server failed.
  int invalid = 0;
  // Effective number of samples in the complete episodes, for intervals (NumSamples); for a suite, the sum
  // over its tasks. Rates and means are always over all complete episodes.
  int samples = 0;
  // Number of complete episodes with a verdict about success (EpisodeResult::judged), and number of
  // successful episodes among them.
  int judged = 0;
  int successes = 0;
  // Number of judged episodes that were decided at the start (EpisodeResult::decided_at_start).
  int decided_at_start = 0;
  // Simulated time of the complete episodes.
  double simulated_s = 0;
  // Number of successful episodes that did not reach every stage.
  int successes_without_stage = 0;
  // Number of complete episodes whose start parameters were in the training set; nullopt if no training set
  // is known.
  std::optional<int> seen_in_training;
  // successes / judged; NaN if no episode was judged.
  double success_rate = 0;
  // Intervals of the success rate, with `samples` as the number of trials. For a finished run: wilson,
  // clopper_pearson. For inspection while the run is active: anytime (statistics/confidence_sequence.h).
  Interval wilson{}, clopper_pearson{}, anytime{};
  std::vector<StageSummary> stages;
  // Failure reasons of the complete episodes that did not succeed; most frequent first.
  std::vector<std::pair<std::string, int>> failure_reasons;
  // Total slips by object, in the order of slip_count_per_object; -1: unknown.
  std::vector<int64_t> slips_per_object;
  // Total collisions by geom, or by pair of robot geoms; most frequent first.
  std::vector<std::pair<std::string, int64_t>> collisions_per_geom;
  // All metrics in order of first appearance, except success and reached stages, which have separate members.
  std::vector<MetricSummary> metrics;
  // One entry for each set of start parameters with at least kFewestToRepeat successful episodes, ordered by
  // the parameters. Empty if the complete episodes count as one sample, or if it was not requested.
  std::vector<StartRepeatability> repeatability;

  const MetricSummary* Find(const std::string& metric) const;
  // Converts a number of complete episodes to the equivalent number of samples.
  double InSamples(int count) const;
  // Returns a note that explains the sample count of the intervals; empty if every episode counts as a
  // separate sample.
  std::string SamplesText() const;
  // Returns, for example, "3 of 50 starts were seen in training"; empty if no training set is known.
  std::string TrainingText() const;
  // Returns a warning that success or failure does not depend on the policy; empty if no episode was decided
  // at the start.
  std::string StartText() const;
  // Returns a warning about a policy whose commands are often clipped or out of reach, which suggests a wrong
  // unit; empty otherwise.
  std::string ActionsText() const;
  // Returns the notes for the reader of the summary: all nonempty texts of the four functions above, most
  // important first.
  std::vector<std::string> Notes() const;
  // Returns a note on stages, which are shown next to the success rate; empty if every success reached every
  // stage.
  std::string StagesText() const;
  // Notes(), and StagesText() if it is not empty.
  std::vector<std::string> NotesWithStages() const;
};

// Statistics that are updated episode by episode. Summary() processes all values added so far, which takes
// 0.1 to 0.6 ms per 1,000 episodes.
class RunStatistics {
 public:
  // If an episode is added twice, its last result counts. task: index of the task in a suite. The episodes of
  // a suite are numbered consecutively across tasks.
  void Add(int episode, const EpisodeResult& result, int task = 0);
  // Returns true if every episode from 0 to the highest added has been added.
  bool is_without_gap() const {
    return episodes_.empty() || episodes_.rbegin()->first + 1 == static_cast<int>(episodes_.size());
  }

  // with_bootstrap: also computes the intervals of the means, which take about a second per thousand
  // episodes, and the repeatability; use it at the end of a run.
  RunSummary Summary(bool with_bootstrap) const;

 private:
  // Result of an episode, without its values. If the episode is incomplete, only `complete` and `invalid` are
  // set.
  struct Entry : EpisodeResult {
    int task = 0;
    std::vector<std::pair<size_t, double>> numbers;  // index in names_, and value
    // Completion time; also set if the episode did not succeed.
    double time_s = 0;
    bool operator==(const Entry&) const = default;
  };
  size_t Index(std::string_view name);
  std::vector<StartRepeatability> Repeatability() const;

  std::map<int, Entry> episodes_;
  std::vector<std::string> names_;
  // Values of a metric. They are sorted before use, so that the results are bit-identical for every order in
  // which episodes finish.
  class Values {
   public:
    void Add(double value) { values_.push_back(value); }
    void Remove(double value);
    const std::vector<double>& Ascending() const;

   private:
    mutable std::vector<double> values_;
    mutable size_t ascending_ = 0;  // number of leading values that are sorted already
  };
  std::vector<Values> values_;
};

// Returns the RUN_SUMMARY message, which contains the statistics that are available while the run is active.
run_summary_t SummaryMessage(const RunSummary& summary);
// Counts and success rate: the first keys of run and suite summaries.
nlohmann::ordered_json RatesJson(const RunSummary& summary);
// Contents of summary.json.
nlohmann::ordered_json SummaryJson(const std::string& task, const std::string& variation,
                                   const RunSummary& summary);

}  // namespace evalbus::metrics
