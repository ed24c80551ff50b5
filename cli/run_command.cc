#include "cli/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/channels.h"
#include "bus/errors.h"
#include "bus/recorder.h"
#include "cli/live_view.h"
#include "cli/network.h"
#include "cli/processes.h"
#include "cli/run_controller.h"
#include "cli/run_folder.h"
#include "cli/version.h"
#include "metrics/collision/collision_component.h"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_options.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

constexpr auto kIdlePoll = std::chrono::milliseconds(20);

nlohmann::ordered_json RunJson(const RunOptions& options, const TaskSelection& selection) {
  const SimOptions& sim = options.sim;
  return {{"run_id", sim.run_id},
          {"task", selection.task.name},
          {"variation", selection.variation},
          {"robot", sim.robot.empty() ? selection.task.robot_file.string() : sim.robot},
          {"policy", options.policy},
          {"episodes", options.episodes},
          {"seed", options.seed},
          {"control_hz", sim.control_hz},
          {"clearance_hz", sim.clearance_hz},
          {"clock", sim.realtime ? "realtime" : "lockstep"},
          {"rtf", sim.rtf},
          {"policy_timeout_s", sim.policy_timeout_s},
          {"in_process", options.in_process},
          {"url", options.in_process ? "memq://" : options.url},
          {"evalbus_version", kVersion},
          {"git_commit", kGitCommit},
          {"git_dirty", kGitDirty},
          {"mujoco_version", mj_versionString()}};
}

// Decides where the run's messages go and says so. What the user asked for is never replaced.
void ChooseBus(RunOptions* options) {
  if (options->in_process) {
    if (!options->url.empty()) throw InputError("--in-process and --url exclude each other");
    return;
  }
  if (!options->url.empty()) {
    const std::string why = WhyNoMulticast(options->url);
    if (!why.empty()) throw EnvironmentError(why);
    return;
  }
  options->url = LocalMulticastUrl(static_cast<uint32_t>(getpid()));
  const std::string why = WhyNoMulticast(options->url);
  if (why.empty()) {
    fmt::print("bus {} (listen with lcm-spy or lcm-logger at this URL)\n", options->url);
    return;
  }
  try {
    EnterPrivateNetwork();
    fmt::print(
        "bus {} in a private network namespace, since this machine has no multicast ('evalbus doctor' says "
        "why); tools outside cannot listen\n",
        options->url);
  } catch (const EnvironmentError&) {
    options->in_process = true;
    options->url.clear();
    fmt::print(
        "everything in one process, since this machine has no multicast ('evalbus doctor' says why)\n");
  }
}

std::vector<std::pair<std::string, std::vector<std::string>>> ComponentCommands(const RunOptions& options,
                                                                                const std::string& out) {
  const SimOptions& sim = options.sim;
  const auto program = [](const std::string& name) { return (Processes::BinaryFolder() / name).string(); };
  const std::vector<std::string> url = {"--url", options.url};
  std::vector<std::string> sim_command = {program("evalbus-sim"),
                                          sim.task,
                                          "--out",
                                          out,
                                          "--run-id",
                                          sim.run_id,
                                          "--control-hz",
                                          fmt::format("{}", sim.control_hz),
                                          "--clearance-hz",
                                          fmt::format("{}", sim.clearance_hz),
                                          "--rtf",
                                          fmt::format("{}", sim.rtf),
                                          "--policy-timeout-s",
                                          fmt::format("{}", sim.policy_timeout_s)};
  if (sim.realtime) sim_command.push_back("--realtime");
  if (!sim.robot.empty()) sim_command.insert(sim_command.end(), {"--robot", sim.robot});
  for (const auto& folder : sim.model_path)
    sim_command.insert(sim_command.end(), {"--model-path", folder.string()});
  std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"recorder", {program("evalbus-recorder"), "--out", out}},
      {"collision", {program("evalbus-collision")}},
      {"metrics", {program("evalbus-metrics")}},
      {"policy", {program("evalbus-policy"), "--policy", options.policy}},
      {"sim", std::move(sim_command)},
  };
  for (auto& [name, command] : commands) command.insert(command.end(), url.begin(), url.end());
  return commands;
}

void RunInProcess(const RunOptions& options, const RunFolder& folder, const RunPlan& plan, LiveView* view,
                  run_summary_t* summary) {
  Bus bus("memq://");
  SimOptions sim_options = options.sim;
  sim_options.out = folder.path();
  Recorder recorder(&bus, folder.path());
  CollisionComponent collision(&bus);
  MetricsComponent metrics(&bus);
  PolicyComponent policy(&bus, options.policy);
  SimComponent sim(&bus, sim_options);
  RunController controller(&bus, plan, folder, view);
  const std::vector<Component*> components = {&recorder, &collision, &metrics, &policy, &sim, &controller};
  SteadyTime poll_at{};
  while (!controller.done() && !stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= poll_at) {
      for (Component* component : components) component->Poll(now);
      view->Poll(now);
      poll_at = std::min(now + kIdlePoll, sim.next_poll());
    }
    bus.Handle(poll_at);
  }
  *summary = controller.summary();
}

void RunProcesses(const RunOptions& options, const RunFolder& folder, const RunPlan& plan, LiveView* view,
                  run_summary_t* summary) {
  Bus bus(options.url);
  RunController controller(&bus, plan, folder, view);
  Processes processes;
  const auto commands = ComponentCommands(options, folder.path().string());
  const auto start = [&] {
    for (const auto& [name, command] : commands) processes.Start(name, command, folder.log_file(name));
  };
  start();
  SteadyTime poll_at{};
  while (!controller.done() && !stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= poll_at) {
      controller.Poll(now);
      view->Poll(now);
      poll_at = now + kIdlePoll;
      if (const auto exit = processes.Poll()) {
        // Wrong input is wrong at the next try, too; the component's last line says what it is.
        if (exit->code == 1) {
          const size_t error = exit->description.find("error: ");
          throw InputError(error == std::string::npos ? exit->description
                                                      : exit->description.substr(error + 7));
        }
        processes.KillAll();
        controller.Retry(exit->description);
        start();
      }
    }
    bus.Handle(poll_at);
  }
  *summary = controller.summary();
  if (controller.done()) {
    for (const Processes::Exit& exit : processes.StopAll())
      std::cerr << "warning: " << exit.description << "\n";
  }
}

}  // namespace

void AddRunOptions(CLI::App* app, RunOptions* options) {
  AddSimOptions(app, &options->sim);
  app->add_option("--policy", options->policy, "expert, noisy_expert, random, hold, or replay:RUN_OR_LOG")
      ->capture_default_str();
  app->add_option("--episodes", options->episodes, "number of episodes")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_option("--seed", options->seed, "seed of the run; equal seeds give equal bits")
      ->capture_default_str();
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-POLICY-DATE-TIME");
  app->add_option(
      "--url", options->url,
      "bus, udpm://ADDRESS:PORT?ttl=0; default: the first that works of this machine's multicast, a private\n"
      "network namespace, one process");
  app->add_flag("--in-process", options->in_process,
                "all components in one process, without network; fastest");
}

int Run(RunOptions options) {
  const TaskSelection selection = FindTask(options.sim.task);
  selection.task.variation(selection.variation);
  LoadRobot(options.sim.robot.empty() ? selection.task.robot_file : std::filesystem::path(options.sim.robot),
            options.sim.model_path);
  const std::string policy_name = options.policy.substr(0, options.policy.find(':'));
  const std::filesystem::path out =
      options.out.empty()
          ? DefaultRunFolder(selection.task.name + "-" + selection.variation + "-" + policy_name)
          : std::filesystem::path(options.out);
  const bool existed = std::filesystem::exists(out);
  const RunFolder folder(out);
  options.sim.run_id = folder.path().filename().string();
  InstallStopSignals();
  const auto started = steady_clock::now();
  run_summary_t summary{};
  try {
    ChooseBus(&options);
    folder.WriteJson("run.json", RunJson(options, selection));
    RunPlan plan{selection.task.name,
                 selection.variation,
                 options.episodes,
                 options.seed,
                 {"collision", "metrics", "policy", "recorder"}};
    LiveView view(stdout, {selection.task.name, selection.variation, options.policy,
                           options.sim.realtime ? "realtime" : "lockstep", options.sim.control_hz,
                           options.seed, options.episodes});
    const auto run = options.in_process ? RunInProcess : RunProcesses;
    run(options, folder, plan, &view, &summary);
    view.Finish();
  } catch (...) {
    // Nothing half-written: what has no finished episode is not a run.
    if (!std::filesystem::exists(folder.path() / "episodes.jsonl")) {
      std::error_code ignored;
      for (const auto& entry : std::filesystem::directory_iterator(folder.path(), ignored)) {
        std::filesystem::remove_all(entry, ignored);
      }
      if (!existed) std::filesystem::remove(folder.path(), ignored);
    }
    throw;
  }
  const double wall = std::chrono::duration<double>(steady_clock::now() - started).count();
  fmt::print("\n{}", SummaryTable(summary));
  fmt::print("\n{} episodes in {:.1f} s\n", summary.num_episodes, wall);
  const auto shown = std::filesystem::proximate(folder.path());
  fmt::print("results  {}\n", (shown / "episodes.jsonl").string());
  fmt::print("summary  {}\n", (shown / "summary.json").string());
  fmt::print("logs     {}\n", (shown / "episodes/*/events.lcmlog").string());
  if (summary.num_episodes < options.episodes) {
    throw EnvironmentError(
        fmt::format("stopped after {} of {} episodes", summary.num_episodes, options.episodes));
  }
  return 0;
}

}  // namespace evalbus
