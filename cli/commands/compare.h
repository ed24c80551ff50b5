// evalbus compare: whether runs, or suites, really differ.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct CompareOptions {
  std::vector<std::filesystem::path> runs;
  // Name, policy or folder of the run that the others are compared with; empty: the first.
  std::string baseline;
  // Empty: none is written.
  std::filesystem::path json;
  // HTML page; empty: none is written.
  std::filesystem::path report;
};

void AddCompareOptions(CLI::App* app, CompareOptions* options);

// Returns the exit code: 0, whatever the verdict. Throws InputError.
int Compare(const CompareOptions& options);

}  // namespace evalbus::commands
