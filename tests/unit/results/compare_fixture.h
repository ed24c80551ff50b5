// Writes and reads runs that are compared.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/errors.h"
#include "results/comparison.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results {

inline nlohmann::ordered_json Info(int episodes, int64_t seed = 7, double rate = 50) {
  nlohmann::ordered_json info = RunInfo(episodes);
  info["seed"] = seed;
  info["control_hz"] = rate;
  info["task_sha256"] = "task";
  info["physics_sha256"] = "model";
  return info;
}

class CompareTest : public testing::Test {
 protected:
  RecordedRuns Run(const std::string& name, const nlohmann::ordered_json& info,
                   const std::vector<bool>& success, double time) {
    std::vector<nlohmann::ordered_json> lines;
    for (size_t i = 0; i < success.size(); ++i) {
      const int n = static_cast<int>(i);
      lines.push_back(EpisodeLine(
          n, success[i],
          {{"completion_time", time + 0.01 * n * n}, {"slip_count", 0}, {"subtask_progress", 1}}));
      lines.back()["seed"] = EpisodeSeed(info["seed"], n);
    }
    WriteRun(folder_.path() / name, info, lines);
    return ReadRuns(folder_.path() / name);
  }
  static std::vector<bool> First(int successes, int episodes) {
    std::vector<bool> result(static_cast<size_t>(episodes), false);
    std::fill_n(result.begin(), successes, true);
    return result;
  }
  std::string Refusal(const RecordedRuns& a, const RecordedRuns& b) {
    try {
      CompareRuns(a, b);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder_;
};

}  // namespace evalbus::results
