// Text in columns, for people at a terminal. Lengths are in characters, not in bytes of UTF-8.
#pragma once

#include <string>

namespace evalbus {

int Width(const std::string& text);

// The first `width` characters.
std::string Cut(const std::string& text, int width);

// Filled up with spaces to a width: text to the right, or, where the width is negative, to the left.
std::string Pad(const std::string& text, int width);

// Words of another process, or names in a file, may be any bytes, and a terminal obeys control characters:
// each becomes a question mark.
std::string Printable(const std::string& text);

// "left_gripper" -> "left gripper".
std::string Words(std::string name);

// Five characters, so that columns stay: four significant digits and no more than three decimals, three
// digits behind a minus; thousands ("123k") from 100000 on. "-" for what is not finite.
std::string Number(double value);

// How many decimals show four significant digits of a number of this magnitude; three at most.
int Decimals(double magnitude);

}  // namespace evalbus
