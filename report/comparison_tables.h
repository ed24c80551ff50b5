// Formats comparisons as tables for papers and pull requests.
#pragma once

#include <string>
#include <vector>

#include "report/text_table.h"
#include "results/comparison.h"

namespace evalbus::report {

// Returns one row per run and task, and one row over all tasks for a run with several tasks. Columns: task,
// run and baseline with their numbers of successes and episodes, difference in percentage points, its 95 %
// interval, and p.
TextTable SuccessTable(const std::vector<results::Comparison>& comparisons);

// Return SuccessTable() as Markdown or LaTeX, with a line that states how it was computed.
std::string ComparisonMarkdown(const std::vector<results::Comparison>& comparisons);
std::string ComparisonLatex(const std::vector<results::Comparison>& comparisons);

}  // namespace evalbus::report
