#include "cli/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "bus/errors.h"
#include "cli/evaluate.h"
#include "cli/filming.h"
#include "cli/live_view.h"
#include "cli/network.h"
#include "cli/run_folder.h"
#include "cli/version.h"
#include "sim/sim_options.h"
#include "viz/film.h"
#include "viz/renderer.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

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
void DecideBus(RunOptions* options) {
  if (options->in_process) {
    if (!options->url.empty()) throw InputError("--in-process and --url exclude each other");
    return;
  }
  options->url = ChooseBus(options->url);
  if (options->url.empty()) {
    options->in_process = true;
    fmt::print(
        "everything in one process, since this machine has no multicast ('evalbus doctor' says why)\n");
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
  app->add_option(
         "--video", options->video,
         "cameras, with commas: film each episode while the next one runs; 'evalbus render' does it later")
      ->delimiter(',');
}

int Run(RunOptions options) {
  const TaskSelection selection = FindTask(options.sim.task);
  selection.task.variation(selection.variation);
  const RobotDescription robot = LoadRobot(
      options.sim.robot.empty() ? selection.task.robot_file : std::filesystem::path(options.sim.robot),
      options.sim.model_path);
  if (!options.video.empty()) {
    const Scene scene = BuildScene(selection.task, robot);
    for (const std::string& camera : options.video) FindCamera(*scene.visual, camera);
  }
  const std::string policy_name = options.policy.substr(0, options.policy.find(':'));
  const std::filesystem::path out =
      options.out.empty()
          ? DefaultRunFolder(selection.task.name + "-" + selection.variation + "-" + policy_name)
          : std::filesystem::path(options.out);
  std::vector<std::filesystem::path> made;
  for (auto path = std::filesystem::absolute(out); !std::filesystem::exists(path); path = path.parent_path())
    made.push_back(path);
  const RunFolder folder(out);
  options.sim.run_id = folder.path().filename().string();
  InstallStopSignals();
  const auto started = steady_clock::now();
  run_summary_t summary{};
  std::optional<LiveView> view;
  std::optional<Filming> filming;
  try {
    DecideBus(&options);
    folder.WriteJson("run.json", RunJson(options, selection));
    RunPlan plan{selection.task.name,
                 selection.variation,
                 options.episodes,
                 options.seed,
                 {"collision", "metrics", "policy", "recorder"}};
    view.emplace(stdout, LiveHeader{selection.task.name, selection.variation, options.policy,
                                    options.sim.realtime ? "realtime" : "lockstep", options.sim.control_hz,
                                    options.seed, options.episodes});
    filming.emplace(folder, options.video, &*view);
    const auto evaluate = options.in_process ? EvaluateInProcess : EvaluateProcesses;
    summary = evaluate(options, folder, plan, &*filming);
    view->Finish();
  } catch (...) {
    // Nothing half-written: what has no finished episode is not a run.
    if (!std::filesystem::exists(folder.path() / "episodes.jsonl")) {
      std::error_code ignored;
      for (const auto& entry : std::filesystem::directory_iterator(folder.path(), ignored)) {
        std::filesystem::remove_all(entry, ignored);
      }
      for (const auto& path : made) std::filesystem::remove(path, ignored);
    }
    throw;
  }
  const double wall = std::chrono::duration<double>(steady_clock::now() - started).count();
  fmt::print("\n{}", SummaryTable(summary));
  fmt::print("\n{} episode{} in {:.1f} s\n", summary.num_episodes, summary.num_episodes == 1 ? "" : "s",
             wall);
  auto shown = std::filesystem::proximate(folder.path());
  if (shown.string().starts_with("..")) shown = folder.path();
  fmt::print("results  {}\n", (shown / "episodes.jsonl").string());
  fmt::print("summary  {}\n", (shown / "summary.json").string());
  fmt::print("logs     {}\n", (shown / "episodes/*/events.lcmlog").string());
  filming->Finish();
  for (const std::string& camera : options.video) {
    fmt::print("films    {}\n", (shown / "episodes/*" / FilmName(camera)).string());
  }
  if (summary.num_episodes < options.episodes) {
    throw EnvironmentError(
        fmt::format("stopped after {} of {} episodes", summary.num_episodes, options.episodes));
  }
  return 0;
}

}  // namespace evalbus
