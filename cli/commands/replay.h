// evalbus replay: plays recorded episodes into fresh metrics.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct ReplayOptions {
  std::filesystem::path run_or_log;
  // Of a run: this episode only.
  std::optional<int> episode;
  // Simulated seconds per second.
  double speed = 1;
  // Empty: as for `evalbus run`.
  std::string url;
};

void AddReplayOptions(CLI::App* app, ReplayOptions* options);

// Returns 0 if every score equals the recorded one and nothing was lost, else 2. Throws InputError,
// EnvironmentError.
int Replay(const ReplayOptions& options);

}  // namespace evalbus::commands
