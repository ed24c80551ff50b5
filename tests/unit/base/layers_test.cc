// Checks which folder includes which. docs/contributing.md documents the order.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace evalbus::layers_test {

namespace fs = std::filesystem;

// Each folder may include only headers of the folders before it.
constexpr std::array<std::string_view, 43> kOrder = {"base",
                                                     "lcmtypes",
                                                     "bus/udpm",
                                                     "bus",
                                                     "bus/recorder",
                                                     "models",
                                                     "models/other_engine",
                                                     "sim",
                                                     "collision",
                                                     "metrics/sample",
                                                     "metrics/roboeval",
                                                     "metrics/extended",
                                                     "metrics/task",
                                                     "metrics/statistics",
                                                     "metrics/cause",
                                                     "metrics/episode",
                                                     "metrics",
                                                     "policy_bridge/interface",
                                                     "policy_bridge/planning",
                                                     "policy_bridge/actions",
                                                     "policy_bridge/wire",
                                                     "policy_bridge/contract",
                                                     "policy_bridge/remote",
                                                     "policy_bridge/experts",
                                                     "policy_bridge/policies",
                                                     "policy_bridge",
                                                     "viz/watch",
                                                     "viz/images/painter",
                                                     "viz/images",
                                                     "viz/terminal",
                                                     "viz/viewer",
                                                     "viz/web",
                                                     "viz",
                                                     "results",
                                                     "report/page",
                                                     "report",
                                                     "report/web",
                                                     "export",
                                                     "runner",
                                                     "plans",
                                                     "cli/commands",
                                                     "cli",
                                                     "tests"};
// Processes only exchange messages, so none may include another's headers.
constexpr std::array<std::string_view, 5> kProcesses = {"sim", "collision", "metrics", "policy_bridge",
                                                        "viz"};

size_t Place(const std::string& folder) {
  return static_cast<size_t>(std::ranges::find(kOrder, folder) - kOrder.begin());
}

std::string TopOf(const std::string& folder) { return folder.substr(0, folder.find('/')); }

bool IsProcess(const std::string& folder) {
  return std::ranges::find(kProcesses, TopOf(folder)) != kProcesses.end();
}

// Returns the error of an include; empty if it is allowed.
std::string Wrong(const std::string& folder, const std::string& included) {
  if (folder == included) return "";
  if (Place(folder) == kOrder.size()) return "a folder without a place in the order";
  if (Place(included) >= Place(folder)) return "includes back";
  if (IsProcess(folder) && IsProcess(included) && TopOf(folder) != TopOf(included)) {
    return "a process that knows another";
  }
  return "";
}

TEST(Layers, NothingIncludesBack) {
  const fs::path root = EVALBUS_SOURCE_DIR;
  int includes = 0;
  for (const std::string_view top : kOrder) {
    if (top == "tests" || top.find('/') != std::string_view::npos) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cc") continue;
      const fs::path file = entry.path().lexically_relative(root);
      std::ifstream lines(entry.path());
      constexpr std::string_view kInclude = "#include \"";
      for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(kInclude)) continue;
        std::string included = fs::path(line.substr(kInclude.size())).parent_path().string();
        if (included == "evalbus") included = "lcmtypes";  // generated
        EXPECT_EQ(Wrong(file.parent_path().string(), included), "") << file << ": " << line;
        ++includes;
      }
    }
  }
  EXPECT_GT(includes, 500);
}

TEST(Layers, WhatIsWrongIsSeen) {
  EXPECT_EQ(Wrong("sim", "bus"), "");
  EXPECT_EQ(Wrong("bus", "sim"), "includes back");
  EXPECT_EQ(Wrong("results", "runner"), "includes back");
  EXPECT_EQ(Wrong("metrics/episode", "sim"), "a process that knows another");
  EXPECT_EQ(Wrong("new", "bus"), "a folder without a place in the order");
}

}  // namespace evalbus::layers_test
