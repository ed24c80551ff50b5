#include "base/find_program.h"

#include <unistd.h>

#include <cstdlib>
#include <sstream>

namespace evalbus {

std::filesystem::path FindProgram(const std::string& name) {
  const char* const own = std::getenv("EVALBUS_PATH");
  const char* const path = std::getenv("PATH");
  std::istringstream folders(own ? own : std::string("/usr/bin:") + (path ? path : ""));
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::filesystem::path program = std::filesystem::path(folder) / name;
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

}  // namespace evalbus
