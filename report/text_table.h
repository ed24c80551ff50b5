// Formats tables for other documents.
#pragma once

#include <string>
#include <vector>

namespace evalbus::report {

struct TextTable {
  std::vector<std::string> header;
  // Each row has as many cells as the header. Cells are plain text, which the functions below escape.
  std::vector<std::vector<std::string>> rows;
};

// Escapes a text for a cell of a GitHub Markdown table. Users choose the names of runs, which may contain
// markup.
std::string MarkdownCell(const std::string& text);
std::string MarkdownTable(const TextTable& table);

// Returns a LaTeX tabular with the rules of the package booktabs.
std::string LatexTable(const TextTable& table);

}  // namespace evalbus::report
