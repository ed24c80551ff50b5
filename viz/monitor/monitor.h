// evalbus monitor: watches a run or a replay. Only listens: nothing is published, so nobody can wait for it.
#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace evalbus {

struct MonitorOptions {
  // Bus to listen to; empty: that of the run folder, or of the one run that goes on on this machine.
  std::string url;
  std::filesystem::path run;
};

void AddMonitorOptions(CLI::App* app, MonitorOptions* options);

// A screen where stdout is a terminal, else lines; until q, SIGINT or SIGTERM, lines also until the run is
// over. Returns the exit code. Throws InputError, EnvironmentError.
int Monitor(const MonitorOptions& options);

}  // namespace evalbus
