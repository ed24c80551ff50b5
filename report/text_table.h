// Tables for other documents.
#pragma once

#include <string>
#include <vector>

namespace evalbus::report {

struct TextTable {
  std::vector<std::string> header;
  // Each as long as the header. Cells are plain text, which the functions below escape.
  std::vector<std::vector<std::string>> rows;
};

// Text in GitHub's Markdown, without effect on the markup around it. Names of runs are chosen by users.
std::string MarkdownCell(const std::string& text);
std::string MarkdownTable(const TextTable& table);

// A LaTeX tabular with the rules of the package booktabs.
std::string LatexTable(const TextTable& table);

}  // namespace evalbus::report
