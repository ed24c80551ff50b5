// File and line of something that a user wrote, for error messages.
#pragma once

#include <algorithm>
#include <string>

namespace evalbus {

struct SourceLocation {
  std::string file;
  int line = 0;
  // Returns, for example, "lift_pot.yaml:12".
  std::string ToString() const { return file + ":" + std::to_string(line); }
};

// Converts text to one line, because user text may contain line breaks but an error message is one line.
inline std::string OneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; }, ' ');
  return text;
}

}  // namespace evalbus
