#include "runner/launch.h"

#include <fmt/format.h>

#include <map>

#include "base/realtime.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "runner/component_loop.h"
#include "runner/components.h"
#include "runner/engines.h"
#include "runner/processes.h"

namespace evalbus::runner {
namespace {

using std::chrono::steady_clock;

constexpr auto kIdlePoll = std::chrono::milliseconds(20);
// Time for receiving the last messages of processes that have exited.
constexpr auto kLastWords = std::chrono::milliseconds(20);

// Returns the log file of a component: RUN/logs/sim.log, or sim-0.log for worker 0.
std::filesystem::path LogOf(const RunOptions& options, const std::string& component) {
  return LogFile(options.out,
                 options.worker < 0 ? component : fmt::format("{}-{}", component, options.worker));
}

// Returns the command that starts a component. With --by-hand, users run it themselves.
std::vector<std::string> CommandOf(const ComponentType& type, const RunOptions& options,
                                   const results::RunFolder& folder) {
  const std::string program = type.name == "sim" ? SimProgram(options.sim.engine) : std::string(type.program);
  std::vector<std::string> command = {(Processes::BinaryFolder() / program).string()};
  if (!type.argument.empty()) command.emplace_back(type.argument);
  command.insert(command.end(), {"--options", (folder.path() / kRunJson).string(), "--url", options.url});
  if (options.sim.realtime && type.realtime_priority > 0) {
    command.insert(command.end(), {"--realtime-priority", std::to_string(type.realtime_priority)});
  }
  return command;
}

void ReportDropped(const RunController& controller, RunListener* listener) {
  if (const std::string dropped = controller.DroppedMessages(); !dropped.empty()) listener->OnRemark(dropped);
}

}  // namespace

void EvaluateInProcess(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener) {
  Log::SetFiles([options](const std::string& component) { return LogOf(options, component); });
  Bus bus("memq://");
  ComponentLoop loop(&bus);
  for (const ComponentType& type : ComponentsOf(options)) loop.Add(type.make(&bus, options));
  if (options.sim.realtime) RequestRealtime(kSimRealtimePriority);
  RunController controller(&bus, plan, folder, listener);
  while (!controller.done() && !stop_requested()) {
    loop.Advance([&](SteadyTime now) {
      controller.Poll(now);
      listener->Poll(now);
    });
  }
  ReportDropped(controller, listener);
}

void EvaluateProcesses(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener) {
  Log::SetFiles([options](const std::string& component) { return LogOf(options, component); });
  // Components that users start by hand have no session, so none is required.
  const int64_t session = options.by_hand ? 0 : DrawId();
  Bus bus(options.url, session);
  RunController controller(&bus, plan, folder, listener);
  Processes processes;
  const auto start = [&] {
    std::map<std::string, int64_t> instances;
    for (const ComponentType& type : ComponentsOf(options)) {
      const std::string name(type.name);
      const int64_t instance = instances[name] = DrawId();
      std::vector<std::string> command = CommandOf(type, options, folder);
      command.insert(command.end(),
                     {"--session", std::to_string(session), "--instance", std::to_string(instance)});
      processes.Start(name, command, LogOf(options, name));
    }
    controller.ExpectStart(instances);
  };
  if (options.by_hand) {
    fmt::print("start these processes in any order, on machines that the bus reaches:\n");
    for (const ComponentType& type : ComponentsOf(options)) {
      fmt::print("  {}\n", ShellWords(CommandOf(type, options, folder)));
    }
    std::fflush(stdout);
  } else {
    start();
  }
  const auto start_again = [&](const std::string& why) {
    processes.KillAll();
    controller.Retry(why);
    start();
  };
  SteadyTime poll_at{};
  while (!controller.done() && !stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= poll_at) {
      controller.Poll(now);
      listener->Poll(now);
      poll_at = now + kIdlePoll;
      if (const auto exit = processes.Poll()) {
        // Exit code 1 means invalid input. A restart would not repair this or a lasting failure. The last
        // line of the component's log describes both.
        if (exit->code == 1 || exit->code == kLastingFailureCode) exit->Throw();
        start_again(exit->description);
      } else if (const std::string silent = controller.Silent(now); !silent.empty()) {
        start_again(silent);
      }
    }
    bus.Handle(poll_at);
  }
  if (controller.done()) {
    for (const Processes::Exit& exit : processes.StopAll())
      listener->OnRemark("warning: " + exit.description);
    const auto deadline = steady_clock::now() + kLastWords;
    while (steady_clock::now() < deadline) bus.Handle(deadline);
    ReportDropped(controller, listener);
  }
  // The controller is stopped last, so that observers do not report missing processes.
  controller.Stop();
}

}  // namespace evalbus::runner
