// Implements `evalbus judge`: a page on which an operator gives verdicts on recorded episodes without knowing
// the automatic verdict or the policy.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::report {

struct JudgeOptions {
  // A single run, which may be active or may not have begun, or two finished runs of the same task.
  std::vector<std::filesystem::path> runs;
  std::string operator_name;
  // Seed for the random order in which the episodes of two runs are shown.
  int64_t seed = 0;
  // Port of the page; nullopt: 8080, or a free port if 8080 is in use.
  std::optional<int> port;
  // True if `evalbus watch` started this process. The listening socket is then passed as stdin.
  bool is_child = false;
};

// Serves the page, on the loopback interface only, until SIGINT or SIGTERM. Each verdict is immediately
// written to verdicts.jsonl of its run. When the runs have finished and all episodes have a verdict, the page
// and the terminal show the results. If this is already true when the function is called, it only prints the
// results and returns, unless is_child. Throws InputError or EnvironmentError.
void Judge(const JudgeOptions& options);

// Returns whether the operator has given a verdict on every finished episode that has a log. Throws
// InputError.
bool HasJudgedAll(const std::filesystem::path& run, const std::string& operator_name);

}  // namespace evalbus::report
