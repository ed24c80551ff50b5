#include "cli/launch/launch.h"

#include <fmt/format.h>

#include <iostream>

#include "base/errors.h"
#include "bus/recorder/recorder.h"
#include "cli/launch/processes.h"
#include "collision/collision_component.h"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_options.h"

namespace evalbus::launch {
namespace {

using std::chrono::steady_clock;

constexpr auto kIdlePoll = std::chrono::milliseconds(20);
// For what processes that are gone have said.
constexpr auto kLastWords = std::chrono::milliseconds(20);

void SayDropped(const RunController& controller, RunListener* listener) {
  if (const std::string dropped = controller.DroppedMessages(); !dropped.empty()) listener->OnRemark(dropped);
}

std::vector<std::pair<std::string, std::vector<std::string>>> ComponentCommands(const RunOptions& options,
                                                                                const std::string& out) {
  const sim::SimOptions& sim = options.sim;
  const auto program = [](const std::string& name) { return (Processes::BinaryFolder() / name).string(); };
  const std::vector<std::string> url = {"--url", options.url};
  std::vector<std::string> sim_command = {
      program("evalbus-sim"), sim.task, "--out", out, "--run-id", sim.run_id};
  const std::vector<std::string> sim_arguments = sim::SimArguments(sim);
  sim_command.insert(sim_command.end(), sim_arguments.begin(), sim_arguments.end());
  std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"recorder", {program("evalbus-recorder"), "--out", out}},
      {"collision", {program("evalbus-collision")}},
      {"metrics", {program("evalbus-metrics")}},
      {"sim", std::move(sim_command)},
  };
  if (options.policy != kExternalPolicy) {
    commands.push_back({"policy", {program("evalbus-policy"), "--policy", options.policy}});
  }
  for (auto& [name, command] : commands) command.insert(command.end(), url.begin(), url.end());
  return commands;
}

}  // namespace

void EvaluateInProcess(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener) {
  Bus bus("memq://");
  sim::SimOptions sim_options = options.sim;
  sim_options.out = folder.path();
  Recorder recorder(&bus, folder.path());
  collision::CollisionComponent collision(&bus);
  metrics::MetricsComponent metrics(&bus);
  policy::PolicyComponent policy(&bus, options.policy);
  sim::SimComponent sim(&bus, sim_options);
  RunController controller(&bus, plan, folder, listener);
  const std::vector<Component*> components = {&recorder, &collision, &metrics, &policy, &sim, &controller};
  SteadyTime poll_at{};
  while (!controller.done() && !stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= poll_at) {
      for (Component* component : components) component->Poll(now);
      listener->Poll(now);
      poll_at = std::min(now + kIdlePoll, sim.next_poll());
    }
    bus.Handle(poll_at);
  }
  SayDropped(controller, listener);
}

void EvaluateProcesses(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener) {
  Bus bus(options.url);
  RunController controller(&bus, plan, folder, listener);
  Processes processes;
  const auto commands = ComponentCommands(options, folder.path().string());
  const auto start = [&] {
    for (const auto& [name, command] : commands) {
      processes.Start(name, command,
                      folder.log_file(options.share.empty()
                                          ? name
                                          : fmt::format("{}-{}", name,
                                                        options.share.substr(0, options.share.find('/')))));
    }
    controller.ExpectStart();
  };
  const auto start_again = [&](const std::string& why) {
    processes.KillAll();
    controller.Retry(why);
    start();
  };
  start();
  SteadyTime poll_at{};
  while (!controller.done() && !stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= poll_at) {
      controller.Poll(now);
      listener->Poll(now);
      poll_at = now + kIdlePoll;
      if (const auto exit = processes.Poll()) {
        // Wrong input is wrong at the next try, too; the component's last line says what it is.
        if (exit->code == 1) exit->Throw();
        start_again(exit->description);
      } else if (const std::string silent = controller.Silent(now); !silent.empty()) {
        start_again(silent + " hangs: not a word from it for 10 s");
      }
    }
    bus.Handle(poll_at);
  }
  if (controller.done()) {
    for (const Processes::Exit& exit : processes.StopAll())
      std::cerr << "warning: " << exit.description << "\n";
    const auto deadline = steady_clock::now() + kLastWords;
    while (steady_clock::now() < deadline) bus.Handle(deadline);
    SayDropped(controller, listener);
  }
}

}  // namespace evalbus::launch
