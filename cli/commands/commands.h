// The commands of the program evalbus. Each command has a file and an entry in the list below.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

namespace evalbus::commands {

// Runs a command after its arguments were parsed. Returns the exit code. Throws InputError or
// EnvironmentError.
using Action = std::function<int()>;

// Adds the arguments of a command to its CLI11 subcommand, and returns the command's action.
using AddCommand = Action(CLI::App* app);

// Returns the action of a command whose options are stored in `Options` and added by `add_options`.
template <class Options>
Action ActionOf(CLI::App* app, void (*add_options)(CLI::App*, Options*), int (*run)(const Options&)) {
  const auto options = std::make_shared<Options>();
  add_options(app, options.get());
  return [options, run] { return run(*options); };
}

// COMMAND(function, group, name, description, examples), in the order of --help. Each command has three
// examples.
#define EVALBUS_COMMANDS(COMMAND)                                                                            \
  COMMAND(AddRun, "Evaluate", "run", "evaluate a policy on one or more tasks, or run a plan",                \
          "  evalbus run lift_pot/position --episodes 50 --out runs/expert\n"                                \
          "  evalbus run lift_pot --policy ws://127.0.0.1:8000 --contract plain\n"                           \
          "  evalbus run plan.yaml --out results --workers 2")                                               \
  COMMAND(AddWatch, "Evaluate", "watch", "score an external simulator or a robot while it runs",             \
          "  evalbus watch lift_pot/position --out runs/watched\n"                                           \
          "  evalbus watch lift_pot --control-hz 30 --episodes 10\n"                                         \
          "  evalbus watch lift_pot --policy-name ckpt-12000 --web")                                         \
  COMMAND(AddScore, "Evaluate", "score", "score recorded trajectories, from JSON or tables",                 \
          "  evalbus score trajectory.json\n"                                                                \
          "  evalbus score map.yaml data.csv --out runs/scored\n"                                            \
          "  evalbus score map.yaml folder_of_npz")                                                          \
  COMMAND(AddPlan, "Evaluate", "plan", "show or check a plan of many runs",                                  \
          "  evalbus plan check plan.yaml\n"                                                                 \
          "  evalbus plan show plan.yaml\n"                                                                  \
          "  evalbus run plan.yaml --out results")                                                           \
  COMMAND(AddStatus, "Evaluate", "status", "show the progress of a plan",                                    \
          "  evalbus status results\n"                                                                       \
          "  watch -n 10 evalbus status results\n"                                                           \
          "  evalbus status /shared/results")                                                                \
  COMMAND(AddMerge, "Evaluate", "merge", "combine the parts of a plan, or partial runs, into results",       \
          "  evalbus merge results\n"                                                                        \
          "  evalbus merge runs/all runs/first_half runs/second_half\n"                                      \
          "  evalbus status results && evalbus merge results")                                               \
  COMMAND(AddLatency, "Evaluate", "latency", "measure how inference delay affects a policy",                 \
          "  evalbus latency lift_pot/position --policy noisy_expert --workers 2\n"                          \
          "  evalbus latency lift_pot --policy ws://127.0.0.1:8000 --contract plain --delays 0,100,200\n"    \
          "  evalbus latency stack_two_blocks/position --execution all --out runs/latency")                  \
  COMMAND(AddWeb, "Watch", "web", "show active or finished runs in a browser, in 3D",                        \
          "  evalbus web\n"                                                                                  \
          "  evalbus web runs/expert runs/noisy\n"                                                           \
          "  evalbus web runs/noisy --listen 0.0.0.0")                                                       \
  COMMAND(AddMonitor, "Watch", "monitor", "show an active run or a replay in the terminal",                  \
          "  evalbus monitor\n"                                                                              \
          "  evalbus monitor runs/noisy\n"                                                                   \
          "  evalbus monitor --url 'udpm://239.255.76.67:31234?ttl=0'")                                      \
  COMMAND(AddBridge, "Watch", "bridge", "stream an active run to Foxglove or PlotJuggler",                   \
          "  evalbus bridge foxglove\n"                                                                      \
          "  evalbus bridge foxglove runs/noisy --episode 3\n"                                               \
          "  evalbus bridge plotjuggler localhost:9870")                                                     \
  COMMAND(AddCompare, "Compare", "compare", "test whether runs or suites differ, paired by seed",            \
          "  evalbus compare runs/expert runs/noisy\n"                                                       \
          "  evalbus compare runs/a runs/b runs/c --baseline a --json comparison.json\n"                     \
          "  evalbus compare runs/expert runs/noisy --report comparison.html")                               \
  COMMAND(AddGate, "Compare", "gate",                                                                        \
          "decide whether a run may replace its baseline: PASS, FAIL, CANNOT TELL",                          \
          "  evalbus gate runs/baseline runs/new\n"                                                          \
          "  evalbus gate runs/baseline runs/new --margin 3 --on slips:0.2,completion_time:10%\n"            \
          "  evalbus gate runs/baseline runs/new --junit gate.xml --markdown gate.md")                       \
  COMMAND(AddWhy, "Compare", "why", "find what drives failure: start parameters, points of no return",       \
          "  evalbus why runs/noisy\n"                                                                       \
          "  evalbus why runs/noisy --json why.json\n"                                                       \
          "  evalbus why runs/noisy --episode 3")                                                            \
  COMMAND(AddCertify, "Compare", "certify", "test whether verdicts depend on the version of MuJoCo",         \
          "  evalbus certify lift_pot/position --engines 2.2,3.3.3 --out runs/certified\n"                   \
          "  evalbus certify lift_pot/all --engines 2.2,3.3.3 --policies expert,hold --out runs/all\n"       \
          "  evalbus certify plan.yaml --engines 2.2,3.3.3 --workers 2 --out runs/plan")                     \
  COMMAND(AddJudge, "Compare", "judge", "judge episodes blind, without seeing the policy or the score",      \
          "  evalbus judge runs/watched --operator ann\n"                                                    \
          "  evalbus judge runs/a runs/b --operator ann\n"                                                   \
          "  evalbus judge runs/a runs/b --json judged.json")                                                \
  COMMAND(AddReport, "Compare", "report", "write a run, a suite or a plan as one HTML page",                 \
          "  evalbus report runs/noisy\n"                                                                    \
          "  evalbus report runs/noisy --out noisy.html --mb 20\n"                                           \
          "  evalbus report results --latex table.tex")                                                      \
  COMMAND(AddCollect, "Record", "collect", "record successful demonstrations from evenly spread starts",     \
          "  evalbus collect lift_pot/position --episodes 200 --out runs/set\n"                              \
          "  evalbus collect lift_pot/position --episodes 200 --noise 0.03 --out runs/set\n"                 \
          "  evalbus collect lift_pot/position --episodes 200 --out runs/set --resume")                      \
  COMMAND(AddRender, "Record", "render", "render videos of recorded episodes",                               \
          "  evalbus render runs/noisy --episode 3 --camera front,head\n"                                    \
          "  evalbus render runs/noisy --episode 3 --layout full\n"                                          \
          "  evalbus render runs/noisy --grid 4x3")                                                          \
  COMMAND(AddReplay, "Record", "replay", "replay recorded episodes on the bus and compare their scores",     \
          "  evalbus replay runs/noisy --episode 3\n"                                                        \
          "  evalbus replay runs/noisy --speed 10\n"                                                         \
          "  evalbus replay runs/noisy --episode 3 --web")                                                   \
  COMMAND(AddRescore, "Record", "rescore", "recompute the scores of recorded episodes offline",              \
          "  evalbus rescore runs/noisy\n"                                                                   \
          "  evalbus rescore runs/noisy --task my_lift_pot.yaml\n"                                           \
          "  evalbus rescore runs/noisy --out scores.jsonl")                                                 \
  COMMAND(AddVerify, "Record", "verify",                                                                     \
          "check that recorded results are unchanged and follow from the logs",                              \
          "  evalbus verify runs/noisy\n"                                                                    \
          "  evalbus verify runs/noisy --write\n"                                                            \
          "  evalbus verify results --hashes")                                                               \
  COMMAND(AddExport, "Record", "export", "export episodes: tables, training sets, results",                  \
          "  evalbus export runs/noisy --csv noisy.csv\n"                                                    \
          "  evalbus export runs/noisy --mcap\n"                                                             \
          "  evalbus export runs/set --hdf5 set.hdf5 --camera head")                                         \
  COMMAND(AddDemo, "Record", "demo", "inspect or downsample RoboEval's demonstrations",                      \
          "  evalbus demo info demonstrations\n"                                                             \
          "  evalbus demo convert demonstrations --hz 20 --out at_20_hz\n"                                   \
          "  evalbus run lift_pot --policy demo:demonstrations")                                             \
  COMMAND(AddTasks, "Extend", "tasks", "list, show, copy or check tasks",                                    \
          "  evalbus tasks list\n"                                                                           \
          "  evalbus tasks show lift_pot/position --image scene.png\n"                                       \
          "  evalbus tasks new my_pot --from lift_pot")                                                      \
  COMMAND(AddRobots, "Extend", "robots", "list, show or check robots",                                       \
          "  evalbus robots list\n"                                                                          \
          "  evalbus robots show single_panda --image robot.png\n"                                           \
          "  evalbus robots check my_robot.yaml")                                                            \
  COMMAND(AddPolicy, "Extend", "policy", "list, show or check contracts; serve checkpoints",                 \
          "  evalbus policy list\n"                                                                          \
          "  evalbus policy show plain\n"                                                                    \
          "  evalbus policy check ws://127.0.0.1:8000 --contract plain")                                     \
  COMMAND(AddEnv, "Extend", "env", "serve a task as an environment over standard input and output",          \
          "  evalbus env lift_pot/position\n"                                                                \
          "  evalbus env lift_pot/position --control eef_delta --camera head --image-size 224x224\n"         \
          "  evalbus env lift_pot/position --contract plain")                                                \
  COMMAND(AddDoctor, "Machine", "doctor", "check the setup of this machine, and show how to fix what fails", \
          "  evalbus doctor\n"                                                                               \
          "  evalbus doctor > machine.txt\n"                                                                 \
          "  evalbus doctor && evalbus run lift_pot")

#define EVALBUS_DECLARE(function, group, name, description, examples) AddCommand function;
EVALBUS_COMMANDS(EVALBUS_DECLARE)
#undef EVALBUS_DECLARE

// Subcommands of `evalbus bridge`.
AddCommand AddFoxgloveBridge, AddPlotjugglerBridge;

}  // namespace evalbus::commands
