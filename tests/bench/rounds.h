// Helpers for benchmarks of whole runs: their folder, number of episodes and rounds, and statistics of their
// times.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {

struct Amount {
  int episodes, rounds;
};

// Like ParseArguments(), but also parses --episodes and --rounds.
inline std::optional<int> ParseAmount(int argc, char** argv, const std::string& description, Amount* amount) {
  CLI::App app{description};
  app.add_option("--episodes", amount->episodes, "episodes of a round")->capture_default_str();
  app.add_option("--rounds", amount->rounds, "rounds, whose median counts")->capture_default_str();
  return ParseArguments(&app, argc, argv);
}

// Calls measure(folder) and removes the folder afterwards. Returns the exit code of the program, which is 2
// after an exception. The exception is reported in one line on stderr.
inline int RunInFolder(const std::function<void(const std::filesystem::path& folder)>& measure) {
  try {
    const TemporaryFolder folder;
    measure(folder.path());
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 2;
  }
}

inline double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace evalbus
