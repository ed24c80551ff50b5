// Formats comparisons as tables for papers and pull requests.
#pragma once

#include <string>
#include <vector>

#include "results/comparison.h"

namespace evalbus::report {

// A table for other documents.
struct TextTable {
  std::vector<std::string> header;
  // Each row has as many cells as the header. Cells are plain text, which the functions below escape.
  std::vector<std::vector<std::string>> rows;
};

// Escapes a string for a cell of a GitHub Markdown table. Users choose the names of runs, which may contain
// markup.
std::string MarkdownCell(const std::string& text);
std::string MarkdownTable(const TextTable& table);

// Returns a LaTeX tabular with the rules of the package booktabs.
std::string LatexTable(const TextTable& table);

// Returns the counts and the 95 % interval of a success rate, for example "43/50 (74 to 93 %)"; "-" without
// an episode. samples: effective number of episodes in the interval (metrics::NumSamples).
std::string RateCell(int successes, int trials, double samples);

// Returns one row per run and task, and one row over all tasks for a run with several tasks. Columns: task,
// run and baseline with their numbers of successes and episodes and the rate's interval, difference in
// percentage points, its 95 % interval, and p.
TextTable SuccessTable(const std::vector<results::Comparison>& comparisons);

// Return SuccessTable() as Markdown or LaTeX, with a line that states how it was computed.
std::string ComparisonMarkdown(const std::vector<results::Comparison>& comparisons);
std::string ComparisonLatex(const std::vector<results::Comparison>& comparisons);

}  // namespace evalbus::report
