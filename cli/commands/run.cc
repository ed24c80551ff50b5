#include "cli/commands/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "bus/private_network.h"
#include "cli/launch/filming.h"
#include "cli/launch/launch.h"
#include "cli/launch/live_view.h"
#include "cli/launch/suite.h"
#include "cli/launch/workers.h"
#include "cli/results/pacing.h"
#include "cli/results/run_folder.h"
#include "cli/results/summary_table.h"
#include "cli/version.h"
#include "metrics/statistics/run_statistics.h"
#include "policy_bridge/factory.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_options.h"
#include "viz/pictures/film.h"
#include "viz/pictures/renderer.h"
#include "viz/terminal/terminal.h"

namespace evalbus::commands {
namespace {

using std::chrono::steady_clock;

nlohmann::ordered_json RunJson(const launch::RunOptions& options, const TaskSelection& selection) {
  const sim::SimOptions& sim = options.sim;
  return {{"run_id", sim.run_id},
          {"task", selection.task.name},
          {"variation", selection.variation},
          {"task_sha256", Sha256File(selection.task.file)},
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
void DecideBus(launch::RunOptions* options) {
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

void AddRunOptions(CLI::App* app, launch::RunOptions* options) {
  app->add_option(
         "task", options->tasks,
         "TASK[/VARIATION] or RoboEval's name: lift_pot/position, LiftPotPosition; several, TASK/all or all\n"
         "make a suite: a folder of runs with one summary")
      ->required();
  sim::AddSimOptions(app, &options->sim);
  app->add_option("--policy", options->policy, policy::PolicyHelp() + "\nlcm: a process of yours on --url")
      ->capture_default_str();
  app->add_option("--episodes", options->episodes, "number of episodes")
      ->check(sim::Positive)
      ->capture_default_str();
  app->add_option("--only", options->only, "of the episodes, counted from 0, run these only, with commas")
      ->delimiter(',')
      ->check(sim::NotNegative);
  app->add_option("--seed", options->seed, "seed of the run; equal seeds give equal bits")
      ->capture_default_str();
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-POLICY-DATE-TIME");
  app->add_flag("--resume", options->resume, "go on with the interrupted run in --out");
  app->add_option("--workers", options->workers,
                  "episodes (of a suite: runs) at the same time; the same results")
      ->check(sim::Positive)
      ->capture_default_str();
  // For the workers themselves.
  app->add_option("--share", options->share)->group("");
  app->add_option(
      "--url", options->url,
      "bus, udpm://ADDRESS:PORT?ttl=0; default: the first that works of this machine's multicast, a private\n"
      "network namespace, one process");
  app->add_flag("--in-process", options->in_process,
                "all components in one process, without network; fastest");
  app->add_option(
         "--video", options->video,
         "cameras, with commas: film each episode while the next one runs ('evalbus render' does it later);\n"
         "none: no films, the default")
      ->delimiter(',')
      ->allow_extra_args(false);
}

namespace {

// What must be the same in a run that is gone on with.
constexpr std::array kFixed = {"task",       "variation",     "task_sha256",      "robot",
                               "policy",     "seed",          "control_hz",       "clearance_hz",
                               "clock",      "rtf",           "policy_timeout_s", "evalbus_version",
                               "git_commit", "mujoco_version"};

// Throws InputError if the folder's run was made differently or has more episodes than are wanted.
void CheckResumable(const results::RunFolder& folder, const nlohmann::ordered_json& run,
                    const std::vector<nlohmann::ordered_json>& finished) {
  const auto file = folder.path() / kRunJson;
  const nlohmann::ordered_json before = ReadJsonFile(file);
  if (!before.is_object()) throw InputError("--resume: " + file.string() + ": not a JSON object");
  for (const char* key : kFixed) {
    if (before.value(key, nlohmann::ordered_json()) == run[key]) continue;
    throw InputError(fmt::format("--resume: {}: the run was made with {} {}, not {}", file.string(), key,
                                 ToText(before.value(key, nlohmann::ordered_json())), ToText(run[key])));
  }
  if (!finished.empty() && finished.back()["episode"] >= run["episodes"]) {
    throw InputError(fmt::format("--resume: {} has episode {} already; --episodes {} is less",
                                 folder.path().string(), finished.back()["episode"].dump(),
                                 run["episodes"].dump()));
  }
}

launch::RunPlan PlanOf(const launch::RunOptions& options, const TaskSelection& selection,
                       const std::vector<nlohmann::ordered_json>& finished) {
  launch::RunPlan plan{selection.task.name,
                       selection.variation,
                       {},
                       options.seed,
                       {"collision", "metrics", "policy", "recorder"}};
  plan.realtime = options.sim.realtime;
  plan.policy_is_external = options.policy == launch::kExternalPolicy;
  plan.policy_timeout_s = options.sim.policy_timeout_s;
  std::set<int> there;
  for (const auto& episode : finished) there.insert(episode["episode"].get<int>());
  for (int episode = 0; episode < options.episodes; ++episode) {
    const bool is_wanted =
        options.only.empty() || std::ranges::find(options.only, episode) != options.only.end();
    if (is_wanted && !there.contains(episode)) plan.episodes.push_back(episode);
  }
  return plan;
}

// A worker's part: episodes only.
int RunShare(launch::RunOptions options, const TaskSelection& selection) {
  const results::RunFolder folder = results::RunFolder::OfWorker(options.out);
  options.sim.run_id = folder.path().filename().string();
  InstallStopSignals();
  DecideBus(&options);
  launch::RunPlan plan =
      PlanOf(options, selection, results::EpisodeLines(folder.path() / kEpisodesJsonl).Next());
  plan.episodes = launch::EpisodesOfShare(plan.episodes, options.share);
  // What this worker left where it was killed.
  for (const int episode : plan.episodes) folder.DiscardEpisode(episode);
  launch::WorkerLog log;
  (options.in_process ? launch::EvaluateInProcess : launch::EvaluateProcesses)(options, folder, plan, &log);
  return 0;
}

int RunOne(launch::RunOptions options) {
  const TaskSelection selection = FindTask(options.sim.task);
  // As run.json has it and the sim is told.
  if (!options.sim.robot.empty()) options.sim.robot = std::filesystem::absolute(FindRobot(options.sim.robot));
  const RobotDescription robot =
      LoadRobot(options.sim.robot.empty() ? selection.task.robot_file : options.sim.robot.c_str(),
                options.sim.model_path);
  if (!options.share.empty()) return RunShare(std::move(options), selection);
  if (!options.video.empty()) {
    const Scene scene = BuildScene(selection.task, robot);
    for (const std::string& camera : options.video) viz::FindCamera(*scene.visual, camera);
  }
  const std::string policy_name = options.policy.substr(0, options.policy.find(':'));
  const std::filesystem::path out =
      options.out.empty()
          ? results::DefaultRunFolder(selection.task.name + "-" + selection.variation + "-" + policy_name)
          : std::filesystem::path(options.out);
  std::vector<std::filesystem::path> made;
  for (auto path = std::filesystem::absolute(out); !std::filesystem::exists(path); path = path.parent_path())
    made.push_back(path);
  const results::RunFolder folder(out, options.resume);
  options.sim.run_id = folder.path().filename().string();
  const std::vector<nlohmann::ordered_json> finished = folder.SortEpisodes();
  if (std::filesystem::exists(folder.path() / kRunJson)) {
    CheckResumable(folder, RunJson(options, selection), finished);
  }
  auto shown = std::filesystem::proximate(folder.path());
  if (shown.string().starts_with("..")) shown = folder.path();
  InstallStopSignals();
  const auto started = steady_clock::now();
  std::optional<launch::LiveView> view;
  std::optional<launch::Filming> filming;
  size_t num_wanted = 0;
  try {
    if (options.workers == 1) DecideBus(&options);
    folder.WriteJson(kRunJson, RunJson(options, selection));
    const launch::RunPlan plan = PlanOf(options, selection, finished);
    num_wanted = finished.size() + plan.episodes.size();
    view.emplace(stdout,
                 launch::LiveHeader{selection.task.name, selection.variation, options.policy,
                                    options.sim.realtime ? "realtime" : "lockstep", options.sim.control_hz,
                                    options.seed, static_cast<int>(num_wanted)});
    filming.emplace(folder, options.video, &*view);
    for (const auto& episode : finished) filming->OnEpisodeDone(episode);
    if (plan.policy_is_external) {
      fmt::print("the policy is who says that it is on {}\n", options.url);
      std::fflush(stdout);
    }
    const auto evaluate = options.workers > 1  ? launch::EvaluateWorkers
                          : options.in_process ? launch::EvaluateInProcess
                                               : launch::EvaluateProcesses;
    if (!plan.episodes.empty()) evaluate(options, folder, plan, &*filming);
    view->Finish();
  } catch (...) {
    // Nothing half-written: what has no finished episode is not a run.
    if (!std::filesystem::exists(folder.path() / kEpisodesJsonl)) {
      std::error_code ignored;
      for (const auto& entry : std::filesystem::directory_iterator(folder.path(), ignored)) {
        std::filesystem::remove_all(entry, ignored);
      }
      for (const auto& path : made) std::filesystem::remove(path, ignored);
    }
    throw;
  }
  folder.RemoveFiles(kTemporaryEnding);
  const double wall = std::chrono::duration<double>(steady_clock::now() - started).count();
  metrics::RunStatistics statistics;
  const auto episodes = folder.SortEpisodes();
  for (const auto& episode : episodes) {
    statistics.Add(episode["episode"].get<int>(), metrics::ResultOf(episode));
  }
  const metrics::RunSummary summary = statistics.Summary(true);
  auto summary_json = metrics::SummaryJson(selection.task.name, selection.variation, summary);
  if (options.sim.realtime) summary_json["pacing"] = results::RunPacing(episodes);
  folder.WriteJson(kSummaryJson, summary_json);
  fmt::print("\n{}", results::SummaryTable(summary, viz::TerminalWidth(stdout)));
  if (options.sim.realtime && !episodes.empty())
    fmt::print("\n{}", results::PacingText(summary_json["pacing"]));
  const size_t added = static_cast<size_t>(summary.episodes) - finished.size();
  fmt::print("\n{} episode{} in {:.1f} s{}\n", added, added == 1 ? "" : "s", wall,
             finished.empty() ? "" : fmt::format(", {} there before", finished.size()));
  fmt::print("results  {}\n", (shown / kEpisodesJsonl).string());
  fmt::print("summary  {}\n", (shown / kSummaryJson).string());
  fmt::print("logs     {}\n", (shown / kEpisodesFolder / "*" / kEventLog).string());
  const size_t unfilmed = filming->Finish();
  const double filmed = std::chrono::duration<double>(steady_clock::now() - started).count();
  for (const std::string& camera : options.video) {
    if (unfilmed > 0) break;
    fmt::print("films    {}  (done after {:.1f} s)\n",
               (shown / kEpisodesFolder / "*" / viz::FilmName(camera)).string(), filmed);
  }
  if (summary.episodes < static_cast<int>(num_wanted)) {
    throw EnvironmentError(
        fmt::format("stopped after {} of {} episodes; the same command with --out {} --resume goes on",
                    summary.episodes, num_wanted, shown.string()));
  }
  if (unfilmed > 0) {
    throw EnvironmentError(
        fmt::format("stopped before {} episode{} filmed; the same command with --out {} --resume goes on",
                    unfilmed, unfilmed == 1 ? " was" : "s were", shown.string()));
  }
  return 0;
}

}  // namespace

int Run(launch::RunOptions options) {
  if (options.video == std::vector<std::string>{"none"}) options.video.clear();
  const std::vector<std::string> tasks = launch::ExpandTasks(options.tasks);
  if (options.workers > 1 && !options.url.empty()) {
    throw InputError("--workers and --url exclude each other: each worker has a bus of its own");
  }
  if (options.policy == launch::kExternalPolicy && (options.url.empty() || tasks.size() > 1)) {
    throw InputError(
        "--policy lcm: expected one task, and with --url the bus on which the policy is, as "
        "udpm://239.255.76.67:7667?ttl=0");
  }
  if (options.policy != launch::kExternalPolicy) policy::CheckPolicy(options.policy);
  for (const int episode : options.only) {
    if (episode >= options.episodes) {
      throw InputError(fmt::format("--only {}: expected 0 to {}, since --episodes is {}", episode,
                                   options.episodes - 1, options.episodes));
    }
  }
  if (tasks.size() > 1) return launch::RunSuite(options, tasks);
  options.sim.task = tasks[0];
  return RunOne(std::move(options));
}

}  // namespace evalbus::commands
