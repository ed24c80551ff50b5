// Comparisons as tables for papers and pull requests.
#pragma once

#include <string>
#include <vector>

#include "report/text_table.h"
#include "results/comparison.h"

namespace evalbus::report {

// One row per run and task, and per run over all tasks if it has several: success of both, the difference in
// points, its 95 % interval, and p.
TextTable SuccessTable(const std::vector<results::Comparison>& comparisons);

// The table with a line that states how it was computed.
std::string ComparisonMarkdown(const std::vector<results::Comparison>& comparisons);
std::string ComparisonLatex(const std::vector<results::Comparison>& comparisons);

}  // namespace evalbus::report
