// A page and what its command prints about it.
#pragma once

#include <string>

namespace evalbus::report {

struct BuiltPage {
  std::string html;
  // Which episodes can be played in 3D, as a sentence; empty if none were requested.
  std::string note;
};

}  // namespace evalbus::report
