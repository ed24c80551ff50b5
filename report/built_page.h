// A page, and the sentence that its command prints about it.
#pragma once

#include <string>

namespace evalbus::report {

struct BuiltPage {
  std::string html;
  // A sentence that states which episodes can be played in 3D; empty if none were requested.
  std::string note;
};

}  // namespace evalbus::report
