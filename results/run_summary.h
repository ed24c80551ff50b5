// Writes summary.json of finished runs and suites from their folders.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "results/run_reader.h"
#include "results/summary_table.h"
#include "results/tally.h"

namespace evalbus::results {

struct RunSummary {
  metrics::RunSummary statistics;
  // Value of "pacing" in summary.json; null if the run is not a real-time run, or if an episode has no
  // pacing.
  nlohmann::ordered_json pacing;
  std::vector<std::string> policy_notes;
  // The complete, judged episodes without success, in order.
  std::vector<FailedEpisode> failed;
};

// Writes RUN/summary.json, and sorts episodes.jsonl by episode. Throws InputError if the folder's contents
// are invalid, and the errors of WriteWhole().
RunSummary WriteRunSummary(const std::filesystem::path& folder);

// Returns the contents of summary.json, computed from the run's episodes.
nlohmann::ordered_json RunSummaryJson(const RecordedRun& run);

// Sums up the runs of a suite.
class SuiteTally {
 public:
  // `name`: the task's name as given by the user.
  void Add(const std::string& name, const RecordedRun& run);

  const Tally& of_task(const std::string& name) const { return by_task_.at(name); }
  const std::map<std::string, Tally>& families() const { return families_; }
  const Tally& all() const { return all_; }
  // Returns the unweighted mean of the success rates of the tasks with judged episodes; NaN if there are
  // none.
  double mean_over_tasks() const;
  // Returns mean_over_tasks() as a line of the table; empty for a single task.
  std::string MeanLine(size_t width) const;
  // Contents of a suite's summary.json, with the tasks in this order.
  nlohmann::ordered_json Json(const std::vector<std::string>& names) const;

 private:
  std::map<std::string, Tally> by_task_, families_;
  Tally all_;
};

}  // namespace evalbus::results
