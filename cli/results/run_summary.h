// summary.json of finished runs and suites, from what their folders hold.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/results/run_reader.h"
#include "cli/results/tally.h"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::results {

struct RunSummary {
  metrics::RunSummary statistics;
  // As in summary.json; null where no episode has one.
  nlohmann::ordered_json pacing;
  std::vector<std::string> policy_notes;
};

// Writes RUN/summary.json, and episodes.jsonl in the order of episodes. Throws InputError for what no reader
// takes.
RunSummary WriteRunSummary(const std::filesystem::path& folder);

// What the runs of a suite come to.
class SuiteTally {
 public:
  // `name`: what its task was asked for by.
  void Add(const std::string& name, const RecordedRun& run);

  const Tally& of_task(const std::string& name) const { return by_task_.at(name); }
  const std::map<std::string, Tally>& families() const { return families_; }
  const Tally& all() const { return all_; }
  // Mean of the tasks' success rates, each task with the same weight; NaN without a complete episode.
  double mean_over_tasks() const;
  // The mean as a line of the table; empty for one task.
  std::string MeanLine(size_t width) const;
  // A suite's summary.json, with the tasks in this order.
  nlohmann::ordered_json Json(const std::vector<std::string>& names) const;

 private:
  std::map<std::string, Tally> by_task_, families_;
  Tally all_;
};

}  // namespace evalbus::results
