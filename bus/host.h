// Runs a component alone in its process.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bus/component.h"

namespace CLI {
class App;
}

namespace evalbus {

// Creates a component of a run on a bus.
using ComponentFactory = std::function<std::unique_ptr<Component>(Bus*)>;

// Runs the component until SIGINT, SIGTERM or done(). session, instance: as in Bus. Prints "NAME ready" on
// stdout once the component exists. On failure, the last line on stderr is "error: ...", which the launcher
// reads. Returns the exit code: 0 if done or stopped by a signal, 1 for invalid input, 2 for a failure,
// kLastingFailureCode for a LastingError.
int Host(const std::string& url, const ComponentFactory& make, int64_t session = 0, int64_t instance = 0);

// Implements main() of a component's executable. Adds the options --url and --log-level and the options of
// add_options(), then calls Host().
int HostMain(int argc, char** argv, const std::string& description,
             const std::function<void(CLI::App*)>& add_options, const ComponentFactory& make);

// Adds --log-level. It applies to all logs of this process and, through the environment, of its child
// processes.
void AddLogLevel(CLI::App* app);

// After InstallStopSignals(), stop_requested() is true once SIGINT or SIGTERM was received.
void InstallStopSignals();
bool stop_requested();

}  // namespace evalbus
