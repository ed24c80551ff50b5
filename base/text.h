// Text in columns, for people at a terminal. Lengths are in characters, not in bytes of UTF-8.
#pragma once

#include <string>
#include <vector>

namespace evalbus {

int Width(const std::string& text);

// The first `width` characters.
std::string Cut(const std::string& text, int width);

// Filled up with spaces to a width: text to the right, or, where the width is negative, to the left.
std::string Pad(const std::string& text, int width);

// Words of another process, or names in a file, may be any bytes, and a terminal obeys control characters,
// which XML has no place for: each becomes a question mark, and so does each byte that is no UTF-8.
std::string Printable(const std::string& text);

// A command as it is typed into a shell; what a shell would not take as it is stands in quotes.
std::string ShellWords(const std::vector<std::string>& command);

// "left_gripper" -> "left gripper".
std::string Words(std::string name);

// With so many decimals; what rounds to nothing has no sign.
std::string Fixed(double value, int decimals);

// Five characters, so that columns stay: four significant digits and no more than three decimals, three
// digits behind a minus; thousands ("123k") from 100000 on. "-" for what is not finite. error: see Decimals.
std::string Number(double value, double error = 0);

// How many decimals show four significant digits of a number of this magnitude; three at most.
int Decimals(double magnitude);
// The same for a number that is known to within `error`: no more than two digits of the error. An error that
// is 0 or not finite limits nothing.
int Decimals(double magnitude, double error);

}  // namespace evalbus
