// Draws a row of squares, one per episode or per pair of episodes.
#pragma once

#include <string>
#include <vector>

#include "report/page/markup.h"

namespace evalbus::report {

struct StripCell {
  // CSS class: "good", "bad" or "incomplete"; see Outcome() in report_numbers.h.
  std::string css_class;
  std::string text;   // a few characters in the square
  std::string title;  // tooltip of the square
  std::string url;
};

// Writes the columns from left to right, each with its cells from top to bottom. All columns must have the
// same number of cells. If there are more than 200 columns, neighbors are combined, and the filled part of a
// square shows their share of successes. The strip is hidden from assistive technology, which uses the table
// of episodes instead.
void WriteStrip(const std::vector<std::vector<StripCell>>& columns, Markup* html);

// Returns the number of neighbors that a square combines; 1 for up to 200 columns.
size_t ColumnsPerSquare(size_t columns);

}  // namespace evalbus::report
