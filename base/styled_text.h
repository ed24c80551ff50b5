// Colors and bold text for terminals.
#pragma once

#include <cstdio>
#include <span>
#include <string>

namespace evalbus {

// Meaning of a text. Colors only repeat information that symbols or words also show.
enum class Style { kPlain, kStrong, kQuiet, kGood, kBad };

// Returns true if `out` is a terminal with colors and the user has not set NO_COLOR (https://no-color.org).
bool UsesColors(std::FILE* out);

// Returns the text after Printable(). If `colors` is true and the style is not kPlain, the text is enclosed
// by the style's escape sequence and a reset.
std::string Styled(const std::string& text, Style style, bool colors);

// Returns one bar per value from 0 to 1, for example "▁▄█". If there are more values than `width`,
// neighboring values share a bar, which shows the last of these values.
std::string Sparkline(std::span<const double> values, int width);

}  // namespace evalbus
