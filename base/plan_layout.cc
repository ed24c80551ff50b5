#include "base/plan_layout.h"

#include <system_error>

#include "base/run_layout.h"
#include "base/text.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Returns the first folder, in alphabetical order, that contains this file and is `levels` levels below
// `folder`; empty if there is none.
fs::path FirstWith(const char* file, const fs::path& folder, int levels) {
  std::error_code error;
  if (levels == 0) return fs::exists(folder / file, error) ? folder : fs::path();
  fs::path first;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code not_a_folder;
    if (!fs::is_directory(entry->path(), not_a_folder)) continue;
    const fs::path found = FirstWith(file, entry->path(), levels - 1);
    if (!found.empty() && (first.empty() || found < first)) first = found;
  }
  return first;
}

}  // namespace

std::string PlanNotExpected(const fs::path& plan, bool accepts_suites) {
  const fs::path example = accepts_suites ? FirstWith(kSuiteJson, plan, 1) : FirstWith(kRunJson, plan, 2);
  return std::string("the folder of a plan; expected ") +
         (accepts_suites ? "the folder of one of its policies or runs" : "the folder of one of its runs") +
         (example.empty() ? "" : ", for example " + Printable(example.string()));
}

}  // namespace evalbus
