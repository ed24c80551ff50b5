// The commands that users type: a file each. cli/main.cc lists them.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace evalbus::commands {

// What a command does once its arguments are there; returns the exit code, throws InputError or
// EnvironmentError.
using Action = std::function<int()>;

// Adds a command's arguments to its part of the command line.
using AddCommand = Action(CLI::App* app);

AddCommand AddCompare, AddDoctor, AddExport, AddMonitor, AddRender, AddReplay, AddReport, AddRescore, AddRun,
    AddScore, AddTasks;

}  // namespace evalbus::commands
