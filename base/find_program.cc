#include "base/find_program.h"

#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "base/installed.h"

namespace evalbus {

std::filesystem::path FindProgram(const std::string& name) {
  const char* const own = std::getenv("EVALBUS_PATH");
  const char* const path = std::getenv("PATH");
  std::istringstream folders(own ? own : std::string("/usr/bin:") + (path ? path : ""));
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::filesystem::path program = std::filesystem::path(folder) / name;
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  const std::filesystem::path beside = ProgramFolder() / name;
  if (access(beside.c_str(), X_OK) == 0) return beside;
  return {};
}

std::filesystem::path FindFfmpeg() {
  if (std::filesystem::path program = FindProgram("ffmpeg"); !program.empty()) return program;
  const char* const named = std::getenv("EVALBUS_FFMPEG");
  if (named && access(named, X_OK) == 0) return named;
  return {};
}

}  // namespace evalbus
