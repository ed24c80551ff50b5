#include "runner/engines.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/errors.h"

namespace evalbus::runner {
namespace {

constexpr std::string_view kProgram = "evalbus-sim";

// Compares versions numerically: "3.3.9" is older than "3.3.10".
bool IsOlder(const std::string& a, const std::string& b) { return strverscmp(a.c_str(), b.c_str()) < 0; }

std::vector<std::string> AvailableEngines(const std::filesystem::path& folder) {
  const std::string prefix = std::string(kProgram) + "-";
  std::vector<std::string> versions;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(prefix)) versions.push_back(name.substr(prefix.size()));
  }
  std::ranges::sort(versions, IsOlder);
  return versions;
}

}  // namespace

std::string FindEngine(const std::string& wanted, const std::string& option,
                       const std::filesystem::path& folder) {
  const std::string own = mj_versionString();
  const auto matches = [&](const std::string& version) {
    return version == wanted || version.starts_with(wanted + ".");
  };
  std::vector<std::string> versions = AvailableEngines(folder);
  if (std::ranges::find(versions, wanted) != versions.end()) return wanted;
  if (matches(own)) return "";
  const auto newest = std::find_if(versions.rbegin(), versions.rend(), matches);
  if (newest != versions.rend()) return *newest;
  const bool is_whole = std::ranges::count(wanted, '.') == 2;
  // A separate sim with evalbus' own version may also exist; the version is listed only once.
  std::erase(versions, own);
  versions.insert(versions.begin(), own);
  throw InputError(fmt::format("{} {}: not built; 'scripts/engine {}' builds it; available: {}", option,
                               wanted, is_whole ? wanted : "VERSION", fmt::join(versions, ", ")));
}

std::string EngineVersion(const std::string& engine) { return engine.empty() ? mj_versionString() : engine; }

std::string SimProgram(const std::string& engine) {
  return std::string(kProgram) + (engine.empty() ? "" : "-" + engine);
}

}  // namespace evalbus::runner
