// The commands that users type: a file each, and a line each in the list below.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace evalbus::commands {

// What a command does once its arguments are there; returns the exit code, throws InputError or
// EnvironmentError.
using Action = std::function<int()>;

// Adds a command's arguments to its part of the command line.
using AddCommand = Action(CLI::App* app);

// COMMAND(function, name, what it does), in the order of --help.
#define EVALBUS_COMMANDS(COMMAND)                                                                           \
  COMMAND(AddRun, "run", "evaluate a policy on a task, with live scores")                                   \
  COMMAND(AddWatch, "watch", "score somebody else's simulator or robot, live")                              \
  COMMAND(AddCollect, "collect", "collect successes of a policy, from starts that are spread evenly")       \
  COMMAND(AddRender, "render", "render videos of episodes from their logs")                                 \
  COMMAND(AddReplay, "replay", "play recorded episodes into fresh metrics; compare with what was recorded") \
  COMMAND(AddRescore, "rescore", "score recorded episodes again, offline; compare with what was recorded")  \
  COMMAND(AddCompare, "compare", "say whether runs, or suites, really differ")                              \
  COMMAND(AddExport, "export", "write episodes for other programs: table, training set, MCAP")              \
  COMMAND(AddDemo, "demo", "what demonstrations of RoboEval hold; the same with fewer steps")               \
  COMMAND(AddReport, "report", "write a run, or a suite of runs, as one HTML page")                         \
  COMMAND(AddPlan, "plan", "what a plan of many runs means; check one")                                     \
  COMMAND(AddMerge, "merge", "make one run, or a plan's results, of parts")                                 \
  COMMAND(AddStatus, "status", "how far a plan is, from its folder")                                        \
  COMMAND(AddTasks, "tasks", "what there is to run; check a task file")                                     \
  COMMAND(AddPolicy, "policy", "contracts of policies behind a server; check a server")                     \
  COMMAND(AddRobots, "robots", "which robots there are; check a robot's description")                       \
  COMMAND(AddMonitor, "monitor", "watch a run or a replay while it goes on")                                \
  COMMAND(AddWeb, "web", "show runs in a browser, while they go on or afterwards")                          \
  COMMAND(AddFoxglove, "foxglove", "show a run that goes on, or a recorded episode, in Foxglove")           \
  COMMAND(AddTap, "tap", "send the numbers of a run that goes on to PlotJuggler")                           \
  COMMAND(AddScore, "score", "score one recorded trajectory (JSON), print the result dictionary")           \
  COMMAND(AddDoctor, "doctor", "check what this machine offers and how to mend it")

#define EVALBUS_DECLARE(function, name, description) AddCommand function;
EVALBUS_COMMANDS(EVALBUS_DECLARE)
#undef EVALBUS_DECLARE

}  // namespace evalbus::commands
