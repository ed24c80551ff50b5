// Lines of text for a terminal. Each span of a line has a style.
#pragma once

#include <string>
#include <vector>

#include "base/styled_text.h"

namespace evalbus::viz {

struct Span {
  std::string text;
  Style style = Style::kPlain;
};
using Line = std::vector<Span>;

// A line of a screen with its rank. If the screen is too small, the lines with the highest rank are dropped
// first.
struct RankedLine {
  int rank;
  Line line;
};

// Return a line's width in characters, and its text without styles and without trailing spaces.
int LineWidth(const Line& line);
std::string LineText(const Line& line);

// Returns the text, padded or cut to exactly this width.
std::string Fit(const std::string& text, int width);

// Cuts the line to at most this width.
void Shorten(int width, Line* line);

}  // namespace evalbus::viz
