#include "runner/engines.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "runner/processes.h"

namespace evalbus::runner {
namespace {

constexpr std::string_view kProgram = "evalbus-sim";

// "3.3.10" > "3.3.9"
bool IsOlder(const std::string& a, const std::string& b) { return strverscmp(a.c_str(), b.c_str()) < 0; }

std::vector<std::string> AvailableEngines() {
  const std::string prefix = std::string(kProgram) + "-";
  std::vector<std::string> versions;
  for (const auto& entry : std::filesystem::directory_iterator(Processes::BinaryFolder())) {
    const std::string name = entry.path().filename();
    if (name.starts_with(prefix)) versions.push_back(name.substr(prefix.size()));
  }
  std::ranges::sort(versions, IsOlder);
  return versions;
}

}  // namespace

std::string FindEngine(const std::string& wanted) {
  const std::vector<std::string> versions = AvailableEngines();
  std::string found, list;
  for (const std::string& version : versions) {
    if (version == wanted || version.starts_with(wanted + ".")) found = version;
    list += (list.empty() ? "" : ", ") + version;
  }
  if (!found.empty()) return found;
  throw InputError("--engine " + wanted + ": there is " +
                   (list.empty() ? "no sim with another MuJoCo" : "only " + list) +
                   "; 'scripts/engine VERSION' builds one");
}

std::string SimProgram(const std::string& engine) {
  return std::string(kProgram) + (engine.empty() ? "" : "-" + engine);
}

}  // namespace evalbus::runner
