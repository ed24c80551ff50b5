// Where something was written, for error messages.
#pragma once

#include <string>

namespace evalbus {

struct SourceLocation {
  std::string file;
  int line = 0;
  // "lift_pot.yaml:12"
  std::string ToString() const { return file + ":" + std::to_string(line); }
};

}  // namespace evalbus
