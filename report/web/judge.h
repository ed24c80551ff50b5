// `evalbus judge`: a page on which an operator gives verdicts on recorded episodes without knowing the
// automatic verdict and the policy.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::report {

struct JudgeOptions {
  // One run, which may be active or not have begun yet, or two finished runs of the same task.
  std::vector<std::filesystem::path> runs;
  std::string operator_name;
  // Seed of the order in which the episodes of two runs are shown.
  int64_t seed = 0;
  // Default: 8080, or a free port if that is in use.
  std::optional<int> port;
  // Started by `evalbus watch`; the listening socket is passed as stdin.
  bool is_child = false;
};

// Serves the page, on the loopback interface only, until SIGINT or SIGTERM; each verdict is written to
// verdicts.jsonl of its run at once. When the runs have finished and all episodes have a verdict, the page
// and the terminal show the results. If that is so at the start, only prints them. Throws InputError,
// EnvironmentError.
void Judge(const JudgeOptions& options);

// Whether the operator has given a verdict on every finished episode that has a log. Throws InputError.
bool HasJudgedAll(const std::filesystem::path& run, const std::string& operator_name);

}  // namespace evalbus::report
