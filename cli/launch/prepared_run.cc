#include "cli/launch/prepared_run.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "bus/private_network.h"
#include "cli/launch/components.h"
#include "cli/launch/version.h"
#include "cli/launch/workers.h"
#include "models/scene.h"
#include "viz/pictures/renderer.h"

namespace evalbus::launch {
namespace {

namespace fs = std::filesystem;

// What must be the same in a run that is gone on with, besides its fixed options.
constexpr std::array kFixedFacts = {"task",       "variation",     "task_sha256", "evalbus_version",
                                    "git_commit", "mujoco_version"};

// Whatever was named is what runs: the file, the robot, whole.
TaskSelection Resolve(RunOptions* options) {
  TaskSelection selection = FindTask(options->sim.task);
  options->sim.task = (fs::absolute(selection.task.file) / selection.variation).string();
  options->sim.robot =
      fs::absolute(options->sim.robot.empty() ? selection.task.robot_file : FindRobot(options->sim.robot));
  return selection;
}

// Throws InputError if the folder's run was made differently or has more episodes than are wanted.
void CheckResumable(const fs::path& folder, const RunOptions& options,
                    const std::vector<nlohmann::ordered_json>& finished) {
  const auto file = folder / kRunJson;
  const nlohmann::ordered_json run = RunJson(options), before = ReadJsonFile(file);
  if (!before.is_object()) throw InputError("--resume: " + file.string() + ": not a JSON object");
  std::vector<std::string> keys(kFixedFacts.begin(), kFixedFacts.end());
  for (const std::string& key : FixedKeys(options)) keys.push_back(key);
  for (const std::string& key : keys) {
    const auto was = before.value(key, nlohmann::ordered_json());
    if (was == run[key]) continue;
    throw InputError(fmt::format("--resume: {}: the run was made with {} {}, not {}", file.string(), key,
                                 ToText(was), ToText(run[key])));
  }
  if (!finished.empty() && finished.back()["episode"] >= options.episodes) {
    throw InputError(fmt::format("--resume: {} has episode {} already; --episodes {} is less",
                                 folder.string(), finished.back()["episode"].dump(), options.episodes));
  }
}

RunPlan PlanOf(const RunOptions& options, const TaskSelection& selection,
               const std::vector<nlohmann::ordered_json>& finished) {
  RunPlan plan;
  plan.task = selection.task.name;
  plan.variation = selection.variation;
  plan.seed = options.seed;
  plan.required = RequiredComponents();
  plan.realtime = options.sim.realtime;
  plan.policy_is_external = options.policy.policy == kExternalPolicy;
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

// Decides where the run's messages go and says so. What the user asked for is never replaced.
void DecideBus(RunOptions* options) {
  if (options->in_process) return;
  options->url = ChooseBus(options->url);
  if (!options->url.empty()) return;
  options->in_process = true;
  fmt::print("everything in one process, since this machine has no multicast ('evalbus doctor' says why)\n");
}

}  // namespace

nlohmann::ordered_json RunJson(const RunOptions& options) {
  const TaskSelection selection = FindTask(options.sim.task);
  nlohmann::ordered_json json = {{"task", selection.task.name},
                                 {"variation", selection.variation},
                                 {"task_sha256", Sha256File(selection.task.file)}};
  json.update(OptionsJson(options));
  json.update({{"evalbus_version", kVersion},
               {"git_commit", kGitCommit},
               {"git_dirty", kGitDirty},
               {"mujoco_version", mj_versionString()}});
  return json;
}

std::string ShortPolicyName(const RunOptions& options) {
  return options.policy.policy.substr(0, options.policy.policy.find(':'));
}

PreparedRun PrepareRun(RunOptions options) {
  const TaskSelection selection = Resolve(&options);
  const RobotDescription robot = LoadRobot(options.sim.robot, options.sim.model_path);
  if (!options.video.empty()) {
    const Scene scene = BuildScene(selection.task, robot);
    for (const std::string& camera : options.video) viz::FindCamera(*scene.visual, camera);
  }
  if (options.out.empty()) {
    options.out = results::DefaultRunFolder(selection.task.name + "-" + selection.variation + "-" +
                                            ShortPolicyName(options));
  }
  std::vector<fs::path> made;
  for (auto path = fs::absolute(options.out); !fs::exists(path); path = path.parent_path())
    made.push_back(path);
  results::RunFolder folder(options.out, options.resume);
  options.out = folder.path();
  options.sim.run_id = folder.path().filename().string();
  auto finished = folder.SortEpisodes();
  if (fs::exists(folder.path() / kRunJson)) CheckResumable(folder.path(), options, finished);
  RunPlan plan = PlanOf(options, selection, finished);
  return {std::move(options), std::move(folder), std::move(plan), std::move(finished), std::move(made)};
}

PreparedRun PrepareWorker(RunOptions options) {
  results::RunFolder folder = results::RunFolder::OfWorker(options.out);
  const int workers = options.workers;
  options.workers = 1;
  auto finished = results::EpisodeLines(folder.path() / kEpisodesJsonl).Next();
  RunPlan plan = PlanOf(options, FindTask(options.sim.task), finished);
  plan.episodes = EpisodesOfWorker(plan.episodes, options.worker, workers);
  // What this worker left where it was killed.
  for (const int episode : plan.episodes) folder.DiscardEpisode(episode);
  DecideBus(&options);
  return {std::move(options), std::move(folder), std::move(plan), std::move(finished), {}};
}

void Announce(PreparedRun* run) {
  // Each worker has a bus of its own.
  if (run->options.workers == 1) DecideBus(&run->options);
  run->folder.WriteJson(kRunJson, RunJson(run->options));
}

void PreparedRun::Undo() const {
  if (fs::exists(folder.path() / kEpisodesJsonl)) return;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder.path(), ignored)) fs::remove_all(entry, ignored);
  for (const auto& path : made) fs::remove(path, ignored);
}

}  // namespace evalbus::launch
