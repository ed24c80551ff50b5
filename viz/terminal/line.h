// Lines of text for a terminal, with what each piece of them means.
#pragma once

#include <string>
#include <vector>

namespace evalbus::viz {

// Meaning of a piece of text. Colors only repeat what symbols and words say.
enum class Style { kPlain, kStrong, kQuiet, kGood, kBad };

struct Span {
  std::string text;
  Style style = Style::kPlain;
};
using Line = std::vector<Span>;

// A line of a screen and how soon it may go where there is less room: the highest rank goes first.
struct RankedLine {
  int rank;
  Line line;
};

// Length in characters and text of a line.
int LineWidth(const Line& line);
std::string LineText(const Line& line);

// Text of exactly this width, cut where it is longer.
std::string Fit(const std::string& text, int width);

// Cuts a line that is wider.
void Shorten(int width, Line* line);

}  // namespace evalbus::viz
