// Formats texts and numbers in columns for a terminal. Lengths are in characters, not in bytes of UTF-8.
#pragma once

#include <string>
#include <vector>

namespace evalbus {

int Width(const std::string& text);

// Returns the first `width` characters of a text.
std::string Cut(const std::string& text, int width);

// Pads a text with spaces to a width: right-aligned, or left-aligned if the width is negative.
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

}  // namespace evalbus
