// Sums up one or several runs of a suite, for a row of the suite's table and for JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/statistics/run_statistics.h"
#include "results/run_reader.h"

namespace evalbus::results {

class Tally {
 public:
  // The sum is bit-identical for any order of the runs.
  void Add(const RecordedRun& run);

  // Returns JSON for a suite's summary.json (docs/run_folder.md).
  nlohmann::ordered_json Json() const;
  metrics::RunSummary Summary() const { return statistics_.Summary(false); }
  // Returns the column titles. width: number of characters of the name column. what: title of this column.
  // colors: see base/styled_text.h.
  static std::string Title(const std::string& what, size_t width, bool colors = false);
  std::string Line(const std::string& name, size_t width, bool colors = false) const;

 private:
  metrics::RunStatistics statistics_;
  int episodes_ = 0, tasks_ = 0;
};

}  // namespace evalbus::results
