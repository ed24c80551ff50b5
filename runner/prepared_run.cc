#include "runner/prepared_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "bus/private_network.h"
#include "policy_bridge/policies/delayed_policy.h"
#include "policy_bridge/policies/replay_policy.h"
#include "results/run_reader.h"
#include "results/verdicts.h"
#include "runner/components.h"
#include "runner/engines.h"
#include "runner/run_json.h"
#include "runner/workers.h"
#include "sim/source_component.h"
#include "viz/images/painter/gl_context.h"
#include "viz/images/video.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;

// A key of run.json that is not a fixed option but must not change when a run is resumed. words: text for
// messages if the value is a hash.
struct Fact {
  const char* key;
  const char* words = nullptr;
};
constexpr std::array kFixedFacts = {
    Fact{"task"},
    Fact{"variation"},
    Fact{"evalbus_version"},
    Fact{"git_commit"},
    Fact{"plugins", "other plugins"},
    Fact{"mujoco_version"},
    Fact{"task_sha256", "another task description"},
    Fact{"robot_sha256", "another robot description"},
    Fact{"physics_sha256", "another physics model"},
    Fact{"visual_sha256", "another visual model"},
    Fact{"limits_sha256", "other force limits"},
    Fact{"policy_contract", "another policy contract"},
    Fact{"trained_on", "another training set"},
    Fact{"painter"},
};

// Finds task and robot, and makes the paths of task, robot, assets, contracts and force limits absolute, so
// that every process of the run uses the same files.
TaskSelection Resolve(RunOptions* options) {
  TaskSelection selection = FindTask(options->sim.task);
  options->sim.task = (fs::absolute(selection.task.file) / selection.variation).string();
  options->sim.robot =
      fs::absolute(options->sim.robot.empty() ? selection.task.robot_file : FindRobot(options->sim.robot));
  options->sim.assets = AbsoluteAssets(options->sim.assets);
  if (!options->sim.engine.empty()) options->sim.engine = FindEngine(options->sim.engine);
  FollowRecording(options);
  std::ranges::sort(options->only);
  const auto repeated = std::ranges::unique(options->only);
  options->only.erase(repeated.begin(), repeated.end());
  // Processes may have different working directories.
  for (std::string* name : {&options->policy.policy, &options->policy.contract}) {
    if (policy::IsContractFile(*name)) *name = fs::absolute(*name).lexically_normal().string();
  }
  options->sim.limits = sim::AbsoluteLimits(options->sim.limits);
  options->policy.contract_sha256.clear();
  if (const auto contract = policy::FindContractOf(options->policy))
    options->policy.contract_sha256 = Sha256Text(contract->text);
  return selection;
}

// Replaces "software" and "auto" by the library that they select. Adds library, device and a possible warning
// to run.json. If the run renders no images, --gl is only checked.
void ChooseRenderer(RunOptions* options, nlohmann::ordered_json* facts) {
  const auto contract = policy::FindContractOf(options->policy);
  if (options->video.empty() && !(contract && contract->needs_images())) {
    viz::CheckGl(options->gl);
    return;
  }
  const viz::GlChoice choice = viz::ChooseGl(options->gl);
  options->gl = choice.library;
  (*facts)["renderer"] = viz::Described(choice);
  if (choice.warning.empty()) return;
  (*facts)["renderer_warning"] = choice.warning;
  fmt::print(stderr, "warning: {}\n", choice.warning);
}

[[noreturn]] void FailDiffers(const fs::path& file, const std::string& key,
                              const nlohmann::ordered_json& before, const nlohmann::ordered_json& now) {
  throw InputError(fmt::format("--resume: {}: the run was made with {} {}, not {}", file.string(), key,
                               ToText(before), ToText(now)));
}

void CheckFacts(const fs::path& file, const nlohmann::ordered_json& before,
                const nlohmann::ordered_json& now) {
  for (const Fact& fact : kFixedFacts) {
    const auto was = before.value(fact.key, nlohmann::ordered_json());
    const auto is = now.value(fact.key, nlohmann::ordered_json());
    if (was == is) continue;
    if (!fact.words) FailDiffers(file, fact.key, was, is);
    throw InputError(fmt::format(
        "--resume: {}: the run was made with {} ({}); restore the changed file, or start another run",
        file.string(), fact.words, fact.key));
  }
}

// Throws InputError if the run in the folder has different options or more episodes than requested.
void CheckResumable(const results::RecordedRun& before, const RunOptions& options,
                    const nlohmann::ordered_json& facts) {
  const fs::path file = before.folder / kRunJson;
  CheckFacts(file, before.info, facts);
  CheckFixedOptions(file, before.info, options);
  if (!before.episodes.empty() && before.episodes.back().episode >= options.episodes) {
    throw InputError(fmt::format(
        "--resume: {} already has episode {}: expected --episodes {} or more, got {}", before.folder.string(),
        before.episodes.back().episode, before.episodes.back().episode + 1, options.episodes));
  }
}

bool IsWanted(const RunOptions& options, int episode) {
  return options.only.empty() || std::ranges::find(options.only, episode) != options.only.end();
}

// Throws InputError if the policy replays a recording in which a requested episode is damaged or incomplete.
void CheckRecording(const RunOptions& options) {
  const std::string path = policy::RecordingPath(options.policy.policy);
  if (path.empty()) return;
  const policy::Recording recording = policy::OpenRecording(path);
  for (int episode = 0; episode < options.episodes; ++episode) {
    if (IsWanted(options, episode)) recording(episode);
  }
}

// Returns "only" of run.json for a run that is resumed with this --only. A run that was planned with all of
// its episodes remains so; otherwise, its missing episodes would no longer be counted.
std::vector<int> UnionOfOnly(const results::RecordedRun& before, const std::vector<int>& only) {
  if (!before.is_part() || only.empty()) return {};
  std::set<int> all(only.begin(), only.end());
  for (const nlohmann::ordered_json& episode : before.info.at("only")) {
    if (episode.is_number_integer()) all.insert(episode.get<int>());
  }
  return {all.begin(), all.end()};
}

// Returns the starts of the training sets in the contract's `trained_on`; nullopt if the contract has none.
std::optional<TrainingStarts> TrainingOf(const RunOptions& options) {
  const auto contract = policy::FindContractOf(options.policy);
  if (!contract || contract->trained_on.empty()) return std::nullopt;
  return TrainingStarts::Of(*contract);
}

RunPlan PlanOf(const RunOptions& options, const nlohmann::ordered_json& facts,
               const std::set<int>& finished) {
  RunPlan plan;
  plan.task = facts["task"].get<std::string>();
  plan.variation = facts["variation"].get<std::string>();
  const auto limits = facts.value("limits_sha256", nlohmann::ordered_json());
  plan.model_hashes = {facts["task_sha256"].get<std::string>(), facts["physics_sha256"].get<std::string>(),
                       facts["visual_sha256"].get<std::string>(),
                       limits.is_string() ? limits.get<std::string>() : ""};
  plan.seed = options.seed;
  plan.seed_stream = options.sim.seed_stream;
  plan.required = RequiredComponents(options);
  plan.realtime = options.sim.realtime;
  plan.is_by_hand = options.by_hand;
  plan.is_watched = options.watch;
  plan.policy_is_external = options.policy.policy == policy::kExternalPolicy;
  if (const auto contract = policy::FindContractOf(options.policy)) {
    plan.calls = {.execute_steps = contract->execute_steps,
                  .settle_steps = contract->settle_steps,
                  .execution = policy::ParseExecution(options.policy.execution)};
  } else if (policy::ParseLatency(options.policy.latency).kind != policy::Latency::Kind::kNone) {
    const int execute_steps = policy::DelayedPolicy::ExecuteSteps(1 / options.sim.control_hz);
    plan.calls = {.execute_steps = execute_steps,
                  .execution = policy::ParseExecution(options.policy.execution),
                  .chunk_steps = policy::DelayedPolicy::kChunkFactor * execute_steps};
  }
  plan.policy_timeout_s = options.sim.policy_timeout_s;
  for (int episode = 0; episode < options.episodes; ++episode) {
    if (IsWanted(options, episode) && !finished.contains(episode)) plan.episodes.push_back(episode);
  }
  return plan;
}

// Chooses the run's bus. A bus that the user requested is never replaced; another bus is printed.
void DecideBus(PreparedRun* run) {
  RunOptions& options = run->options;
  if (options.in_process) return;
  run->bus = ChooseBus(options.url);
  options.url = run->bus.url();
  if (!options.url.empty()) return;
  if (!options.sim.engine.empty()) {
    throw EnvironmentError(
        "--engine requires processes on a bus, but this machine has no multicast (see 'evalbus doctor')");
  }
  options.in_process = true;
  fmt::print(
      "running everything in one process, because this machine has no multicast (see 'evalbus doctor')\n");
}

// Verdicts refer to recordings, so an episode with verdicts is not recorded again. kept: episodes that do not
// run again.
void CheckNoVerdictIsLost(const fs::path& folder, const std::set<int>& kept) {
  for (const results::Verdict& verdict : results::ReadVerdicts(folder)) {
    if (kept.contains(verdict.episode)) continue;
    throw InputError(
        fmt::format("--resume: {} has a verdict of {} on episode {}, which would run again; remove "
                    "the line, or start another run",
                    (folder / results::kVerdictsJsonl).string(), verdict.operator_name, verdict.episode));
  }
}

}  // namespace

void CheckFixedOptions(const fs::path& file, const nlohmann::ordered_json& before,
                       const RunOptions& options) {
  const nlohmann::ordered_json now = OptionsJson(options);
  for (const std::string& key : FixedKeys(options)) {
    // A run that has rendered nothing has not used its library.
    if (key == "gl" && !before.contains("renderer")) continue;
    const auto was = before.value(key, nlohmann::ordered_json());
    if (was != now[key]) FailDiffers(file, key, was, now[key]);
  }
}

std::string ShortPolicyName(const RunOptions& options) {
  std::string name = PolicyName(options);
  if (options.policy_name.empty()) name = name.substr(0, name.find(':'));
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

PreparedRun PrepareRun(RunOptions options) {
  const TaskSelection selection = Resolve(&options);
  CheckRecording(options);
  sim::PreparedScene prepared = sim::ComposeScene(options.sim);
  if (options.watch) sim::CheckSourceOptions(options.sim, prepared.info);
  options.sim.physics_sha256 = prepared.info.physics_sha256;
  options.sim.visual_sha256 = prepared.info.visual_sha256;
  viz::CheckCameras(*prepared.scene.visual, options.video);
  const std::string rate = sim::MakeControlRateReal(prepared.info.timestep_us, &options.sim);
  if (!rate.empty()) fmt::print("{}\n", rate);
  options.sim.scene_warnings = prepared.scene.warnings;
  std::erase(options.sim.scene_warnings, rate);
  nlohmann::ordered_json facts = RunFacts(prepared, options);
  std::optional<TrainingStarts> training = TrainingOf(options);
  if (training) facts["trained_on"] = training->Json();
  ChooseRenderer(&options, &facts);
  results::RunFolder folder = results::RunFolder::OfRun(
      options.out,
      fmt::format("{}-{}-{}", selection.task.name, selection.variation, ShortPolicyName(options)),
      options.resume);
  options.out = folder.path();
  options.sim.run_id = NameOfRun(folder.path());
  std::vector<nlohmann::ordered_json> finished;
  std::set<int> numbers;
  std::vector<int> planned_only = options.only;
  if (fs::exists(folder.path() / kRunJson)) {
    const results::RecordedRun before = results::ReadRunAsFarAsItGot(folder.path());
    CheckResumable(before, options, facts);
    planned_only = UnionOfOnly(before, options.only);
    for (const results::RecordedEpisode& episode : before.episodes) {
      if (episode.invalid && IsWanted(options, episode.episode)) continue;
      finished.push_back(episode.Json());
      numbers.insert(episode.episode);
    }
    CheckNoVerdictIsLost(folder.path(), numbers);
    // Nothing before this line changes the folder.
    folder.DiscardAllBut(numbers);
    if (fs::exists(folder.path() / kEpisodesJsonl)) folder.WriteEpisodes(finished);
  }
  RunPlan plan = PlanOf(options, facts, numbers);
  plan.is_selection = planned_only != options.only;
  plan.trained_on = std::move(training);
  return {std::move(options), std::move(prepared), std::move(facts),       std::move(folder),
          std::move(plan),    std::move(finished), std::move(planned_only)};
}

PreparedRun PrepareWorker(RunOptions options) {
  results::RunFolder folder = results::RunFolder::OfWorker(options.out);
  const int workers = options.workers;
  options.workers = 1;
  const results::RecordedRun before = results::ReadRunAsFarAsItGot(folder.path());
  std::set<int> finished;
  for (const results::RecordedEpisode& episode : before.episodes) finished.insert(episode.episode);
  RunPlan plan = PlanOf(options, before.info, finished);
  plan.trained_on = TrainingOf(options);
  if (plan.trained_on && plan.trained_on->Json() != before.info.at("trained_on")) {
    throw InputError(policy::FindContractOf(options.policy)->file.string() +
                     ": the sets in 'trained_on' changed during the run");
  }
  plan.episodes = EpisodesOfWorker(plan.episodes, options.worker, workers);
  // Removes partial episodes that this worker left when it was killed.
  for (const int episode : plan.episodes) folder.DiscardEpisode(episode);
  PreparedRun run{std::move(options), {}, before.info, std::move(folder), std::move(plan), {}};
  DecideBus(&run);
  return run;
}

void Announce(PreparedRun* run) {
  // If there are several workers, each worker chooses its own bus.
  if (run->options.workers == 1) DecideBus(run);
  if (!run->plan.episodes.empty()) fs::remove(run->folder.path() / kSummaryJson);
  if (run->scene) sim::WriteModels(*run->scene, run->folder.path());
  run->scene.reset();
  nlohmann::ordered_json json = RunJson(run->facts, run->options);
  json["only"] = run->planned_only;
  run->folder.WriteJson(kRunJson, json);
}

}  // namespace evalbus::runner
