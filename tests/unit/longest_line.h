// Width of text in a terminal.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>

namespace evalbus {

// Returns the number of characters of the longest line. UTF-8 continuation bytes do not count.
inline int LongestLine(const std::string& text) {
  std::istringstream lines(text);
  int longest = 0;
  for (std::string line; std::getline(lines, line);) {
    longest = std::max(longest, static_cast<int>(std::count_if(line.begin(), line.end(),
                                                               [](char c) { return (c & 0xC0) != 0x80; })));
  }
  return longest;
}

}  // namespace evalbus
