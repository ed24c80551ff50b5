// Formats strings, numbers, counts and rates, in columns for a terminal or in sentences. Lengths are in
// characters, not in bytes of UTF-8.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace evalbus {

int Width(const std::string& text);

// Returns the first `width` characters of a string.
std::string Cut(const std::string& text, int width);

// Pads a string with spaces to a width: right-aligned, or left-aligned if the width is negative.
std::string Pad(const std::string& text, int width);

// Replaces each control character, each byte that is not UTF-8, and the last two codes of each plane, such as
// U+FFFE and U+FFFF, by a question mark. Texts of other processes and names in files may be arbitrary bytes.
// Terminals execute control characters, and XML does not allow all of them.
std::string Printable(const std::string& text);

// Returns a command as typed into a shell. Words that the shell would interpret are quoted.
std::string ShellWords(const std::vector<std::string>& command);

// Replaces underscores by spaces: "left_gripper" becomes "left gripper".
std::string Words(std::string name);

// Formats a number with this many decimals. A number that rounds to zero has no sign.
std::string Fixed(double value, int decimals);

// Formats a number for a narrow column. It has at most three decimals, and no more than needed for four
// significant digits (three if it is negative). If its magnitude is 100000 or more, thousands are shown
// ("123k"). Numbers from 0 to 9999499 have at most five characters. "-" if it is not finite. error: see
// Decimals().
std::string Number(double value, double error = 0);

// Returns the number of decimals that shows four significant digits of a number of this magnitude; at most
// three.
int Decimals(double magnitude);
// Returns the number of decimals for a number that is known to within `error`. In addition to the limits
// above, at most two digits of the error are shown. An error that is 0 or not finite has no effect.
int Decimals(double magnitude, double error);

inline std::string WithUnit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

// Formats ascending numbers as ranges, for example "0, 2 to 4, 7, 8".
std::string RangesText(const std::vector<int>& numbers);

// Returns "1 episode" or "3 episodes".
inline std::string Plural(int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

// Returns a share as text, rounded to whole percents, halves up: "83 %" for 0.825. "-" if it is NaN or
// infinite. Texts and pages format whole percents with this function, so that a rate is rounded in the same
// way everywhere; viz/viewer/page/dom.js has the same rule for the page in the browser.
inline std::string Percent(double share) {
  if (!std::isfinite(share)) return "-";
  // The double nearest to k / n may be up to 1e-16 too small. Half percents must nevertheless be rounded up.
  return std::to_string(std::llround(std::floor(100 * share + 0.5 + 1e-9))) + " %";
}

// Replaces a lowercase ASCII letter at the beginning by the uppercase one.
inline std::string Capitalized(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 'a' + 'A');
  return text;
}

// Returns the difference of two shares in percentage points, halves rounded away from zero: "-13" for -0.125.
// "-" if the difference is NaN or infinite.
inline std::string PercentagePoints(double difference, int decimals = 0) {
  if (!std::isfinite(difference)) return "-";
  const double scale = std::pow(10, decimals);
  const double size = std::floor(100 * scale * std::abs(difference) + 0.5 + 1e-9) / scale;
  return Fixed(std::copysign(size, difference), decimals);
}

// Returns the number of decimals for the difference of two shares in percentage points: 1 if whole points
// would contradict the whole percents of the shares. For example, 62.5 points are not rounded if the shares
// are shown as 100 % and 38 % (37.5).
inline int PointDecimals(double share, double other) {
  const auto whole = [](double part) { return std::stoi(Percent(part)); };
  if (!std::isfinite(share) || !std::isfinite(other)) return 0;
  return std::stoi(PercentagePoints(share - other)) == whole(share) - whole(other) ? 0 : 1;
}

}  // namespace evalbus
