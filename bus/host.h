// A component alone in its process.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bus/component.h"

namespace CLI {
class App;
}

namespace evalbus {

// A component of a run, on a bus.
using ComponentFactory = std::function<std::unique_ptr<Component>(Bus*)>;

// Works on the bus until SIGINT, SIGTERM or done(); session, instance: as of Bus. Prints "NAME ready" on
// stdout once the component exists. What it fails of is the last line on stderr, "error: ...", by which a
// launcher knows it. Returns the exit code: 0 done, 1 wrong input, 2 failed.
int Host(const std::string& url, const ComponentFactory& make, int64_t session = 0, int64_t instance = 0);

// main() of a component's executable: options --url, --log-level and those that add_options adds, then Host.
int HostMain(int argc, char** argv, const std::string& description,
             const std::function<void(CLI::App*)>& add_options, const ComponentFactory& make);

// --log-level, of whatever logs in this process and, through the environment, in those that it starts.
void AddLogLevel(CLI::App* app);

// True once SIGINT or SIGTERM came, after InstallStopSignals().
void InstallStopSignals();
bool stop_requested();

}  // namespace evalbus
