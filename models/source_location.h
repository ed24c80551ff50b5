// Where something was written, for error messages.
#pragma once

#include <algorithm>
#include <string>

namespace evalbus {

struct SourceLocation {
  std::string file;
  int line = 0;
  // "lift_pot.yaml:12"
  std::string ToString() const { return file + ":" + std::to_string(line); }
};

// What a user wrote may contain line breaks; a message is one line.
inline std::string OneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; }, ' ');
  return text;
}

}  // namespace evalbus
