// evalbus rescore: scores recorded episodes again, offline.
#pragma once

#include <filesystem>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct RescoreOptions {
  std::filesystem::path run_or_log;
  // Another task description; empty: the one in each log.
  std::filesystem::path task;
  // Scores as in episodes.jsonl; empty: none are written.
  std::filesystem::path out;
};

void AddRescoreOptions(CLI::App* app, RescoreOptions* options);

// Returns 0 if every score equals the recorded one or a task is given, else 2. Throws InputError,
// EnvironmentError.
int Rescore(const RescoreOptions& options);

}  // namespace evalbus::commands
