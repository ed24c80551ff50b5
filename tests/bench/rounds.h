// Benchmarks of whole runs: number of episodes and rounds, and statistics of their times.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "base/arguments.h"

namespace evalbus {

struct Amount {
  int episodes, rounds;
};

// Parses --episodes and --rounds; otherwise like ParseArguments().
inline std::optional<int> ParseAmount(int argc, char** argv, const std::string& description, Amount* amount) {
  CLI::App app{description};
  app.add_option("--episodes", amount->episodes, "episodes of a round")->capture_default_str();
  app.add_option("--rounds", amount->rounds, "rounds, whose median counts")->capture_default_str();
  return ParseArguments(&app, argc, argv);
}

inline double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace evalbus
