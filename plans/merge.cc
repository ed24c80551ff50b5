#include "plans/merge.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/file_errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "base/this_process.h"
#include "base/write_whole.h"
#include "lcmtypes/clock.h"
#include "models/task_description.h"
#include "results/log_check.h"
#include "results/no_return.h"
#include "results/notes.h"
#include "results/run_reader.h"
#include "results/run_summary.h"
#include "results/verdicts.h"
#include "runner/progress_line.h"
#include "runner/suite.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Keys of run.json that may differ between the parts of a run: which episodes were run, and where. The
// members of a contract that affect results are compared in "policy_contract"; the server's address may
// differ.
constexpr const char* kOfAPart[] = {"only", "run_id", "url", "workers", "in_process", "contract_sha256"};
// Keys of run.json that a plan does not determine, for example how the run was executed, and the hashes of
// its models.
constexpr const char* kNotOfAPlan[] = {
    "only",       "run_id",         "url",           "workers",        "in_process",     "video", "task_path",
    "control_hz", "physics_sha256", "visual_sha256", "scene_warnings", "contract_sha256"};

ordered_json WithoutPart(ordered_json info) {
  for (const char* key : kOfAPart) info.erase(key);
  return info;
}

// Copies a folder recursively, with hard links if both folders are on one file system.
void Link(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    const fs::path target = to / fs::relative(entry.path(), from);
    std::error_code error;
    if (entry.is_directory()) {
      fs::create_directories(target);
    } else if (fs::create_hard_link(entry.path(), target, error); error) {
      fs::copy_file(entry.path(), target);
    }
  }
}

// Returns true if a run used the planned file. Relative paths and names of built-in robots are compared only
// by file name without extension, because the folder may differ between machines.
bool IsSameFile(const fs::path& planned, const fs::path& made) {
  return planned.is_absolute() ? planned == made : planned.stem() == made.stem();
}

// Returns true if the run evaluated the planned task. made: task that the run recorded; for a task file,
// FILE/VARIATION. If the plan names no variation of a file, any variation is accepted.
bool IsOfTask(const results::RecordedRun& run, const std::string& planned, const fs::path& made) {
  if (!IsTaskFile(planned)) return run.task_name() == planned;
  const fs::path path(planned);
  if (!path.parent_path().empty() && IsTaskFile(path.parent_path())) {
    return path.filename() == made.filename() && IsSameFile(path.parent_path(), made.parent_path());
  }
  return IsSameFile(path, made.parent_path());
}

// Throws InputError unless run.json belongs to this policy and task, and has the plan's current options.
void CheckIsOfPlan(const results::RecordedRun& run, const Plan& plan, const std::string& policy_name,
                   const std::string& task) {
  const std::string file = (run.folder / kRunJson).string();
  const auto fail = [&](const std::string& key, const std::string& is, const std::string& planned) {
    throw InputError(
        fmt::format("{}: {} is {}, but {} in {}; restore the file that was changed, or remove {}", file, key,
                    is, planned, kPlanJson, run.folder.string()));
  };
  runner::RunOptions made;
  runner::ReadOlderOptions(run.info, file, &made);
  if (!IsOfTask(run, task, made.sim.task)) fail("the task", run.task_name(), task);
  const auto policy = std::ranges::find(plan.policies, policy_name, &PlannedPolicy::name);
  const ordered_json is = OptionsJson(made), planned = OptionsJson(plan.OptionsOf(*policy));
  for (const auto& [key, value] : planned.items()) {
    if (std::ranges::find(kNotOfAPlan, key) != std::end(kNotOfAPlan) || is[key] == value) continue;
    // A plan with `until` runs only as many episodes as its decision requires.
    if (key == "episodes" && plan.until) continue;
    // An empty name stands for the task's default robot.
    if (key == "robot" && value == "") continue;
    const bool is_file =
        key == "robot" || key == "limits" ||
        ((key == "policy" || key == "contract") && policy::IsContractFile(value.get<std::string>()));
    if (is_file && IsSameFile(value.get<std::string>(), is[key].get<std::string>())) continue;
    fail(fmt::format("\"{}\"", key), ToText(is[key]), ToText(value));
  }
}

// Throws InputError unless the run's control rate is the plan's control rate, rounded to whole physics steps.
void CheckRate(const results::RecordedRun& run, const Plan& plan, const std::string& policy_name,
               const model_info_t& model) {
  const auto policy = std::ranges::find(plan.policies, policy_name, &PlannedPolicy::name);
  const double planned = RealControlHz(plan.OptionsOf(*policy).sim.control_hz, model.timestep_us);
  if (run.info.at("control_hz") == planned) return;
  throw InputError(fmt::format("{}: \"control_hz\" is {}, expected {:g} as in {}",
                               (run.folder / kRunJson).string(), ToText(run.info.at("control_hz")), planned,
                               kPlanJson));
}

// Collects the names of the checked shards, and shows the progress.
struct Checked {
  explicit Checked(size_t num_episodes) : line(num_episodes, "checking") {}

  // Throws InputError if a run that was checked earlier was simulated by another version of MuJoCo. Machines
  // of a cluster may have different versions.
  void CheckEngine(const results::RecordedRun& run) {
    if (first_folder.empty()) {
      first_folder = run.folder;
      engine = run.engine();
    }
    if (run.engine() == engine) return;
    throw InputError(
        fmt::format("{}: simulated by MuJoCo {}, but {} by MuJoCo {}; remove one of them and run "
                    "its part of the plan again",
                    run.folder.string(), run.engine(), first_folder.string(), engine));
  }

  std::set<std::string> shards;
  fs::path first_folder;
  std::string engine;
  // Shows the progress of reading the logs, which takes a long time for a large plan.
  runner::ProgressLine line;
  size_t episodes = 0;
};

// Throws InputError unless the shard's folder contains exactly the shard's episodes, each with its log.
void CheckPart(const PlanFolder& folder, const Shard& shard, Checked* checked) {
  const results::RecordedRun run = results::ReadRunAsFarAsItGot(folder.shard_folder(shard));
  CheckIsOfPlan(run, folder.plan(), shard.policy, shard.task);
  checked->CheckEngine(run);
  const std::string lines = (run.folder / kEpisodesJsonl).string();
  int next = shard.first;
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (episode.episode < shard.first || episode.episode > shard.last) {
      throw InputError(fmt::format("{}:{}: episode {} does not belong to this shard, which has {} to {}",
                                   lines, episode.line, episode.episode, shard.first, shard.last));
    }
    if (episode.episode == next) ++next;
  }
  if (next <= shard.last) {
    throw InputError(fmt::format(
        "{}: {} of {}, the first missing one is episode {}{}; remove {} and run its part of the plan again",
        lines, run.episodes.size(), Plural(shard.size(), "episode"), next,
        run.cut_line > 0 ? fmt::format(" (line {} is truncated)", run.cut_line) : "", run.folder.string()));
  }
  for (const results::RecordedEpisode& episode : run.episodes) {
    const model_info_t model = results::CheckLog(run, episode);
    CheckRate(run, folder.plan(), shard.policy, model);
    checked->line.Show(static_cast<double>(++checked->episodes));
  }
}

// Throws InputError unless the merged run contains each episode of the shard, with its log and an equal
// result.
void CheckIsMerged(const Shard& shard, const fs::path& part, const results::RecordedRun& merged) {
  std::map<int, std::string> lines;
  for (const results::RecordedEpisode& episode : results::ReadRunAsFarAsItGot(part).episodes) {
    lines[episode.episode] = episode.text;
  }
  for (int number = shard.first; number <= shard.last; ++number) {
    const auto found =
        std::ranges::lower_bound(merged.episodes, number, {}, &results::RecordedEpisode::episode);
    const bool is_there = found != merged.episodes.end() && found->episode == number &&
                          fs::exists(EpisodeLog(merged.folder, number));
    if (is_there && (!lines.contains(number) || lines[number] == found->text)) continue;
    throw InputError(fmt::format(
        "{}: {} was not merged from this folder: its episode {} is {}; remove one of the two folders",
        part.string(), merged.folder.string(), number, is_there ? "different" : "missing"));
  }
}

// Writes the merged run into `out`, a temporary folder that readers ignore.
void MergeInto(const std::vector<fs::path>& parts, const std::string& run_id, const fs::path& out) {
  std::map<int, fs::path> owner;
  std::string lines;
  std::optional<ordered_json> info;
  for (const fs::path& part : parts) {
    const results::RecordedRun run = results::ReadRun(part);
    if (!info) {
      info = run.info;
    } else if (const ordered_json first = WithoutPart(*info), other = WithoutPart(run.info); first != other) {
      ordered_json keys = first;
      keys.update(other);
      for (const auto& [key, unused] : keys.items()) {
        const ordered_json value = first.value(key, ordered_json());
        if (other.value(key, ordered_json()) == value) continue;
        throw InputError(
            fmt::format("{}: \"{}\" is {}, but {} in {}: not parts of one run", (part / kRunJson).string(),
                        key, ToText(other.value(key, ordered_json())), ToText(value), parts[0].string()));
      }
    }
    for (const results::RecordedEpisode& episode : run.episodes) {
      const auto [first, is_new] = owner.emplace(episode.episode, part);
      if (!is_new) {
        throw InputError(fmt::format("{}: episode {} is also in {}", part.string(), episode.episode,
                                     first->second.string()));
      }
      Link(EpisodeFolder(part, episode.episode), EpisodeFolder(out, episode.episode));
      lines += episode.text + "\n";
    }
    // The logs of the components are kept in one folder per part.
    if (fs::exists(part / kLogsFolder)) Link(part / kLogsFolder, out / kLogsFolder / run.name);
  }
  Link(parts[0] / kModelFolder, out / kModelFolder);
  (*info)["run_id"] = run_id;
  (*info)["only"] = ordered_json::array();
  (*info)["workers"] = 1;
  WriteWhole(out / kRunJson, ToText(*info, 2) + "\n");
  WriteWhole(out / kEpisodesJsonl, lines);
  results::WriteRunSummary(out);
}

// Copies data that were added to a part after its evaluation: notes, verdicts of operators and points of no
// return. Otherwise they would be lost, because a merged part is removed.
void AddLaterFindings(const fs::path& part, const fs::path& out) {
  for (const auto& [episode, note] : results::ReadNotes(part)) results::WriteNote(out, episode, note);
  for (const results::Verdict& verdict : results::ReadVerdicts(part)) results::WriteVerdict(out, verdict);
  const results::NoReturns points = results::ReadNoReturns(part);
  if (!points.empty()) results::AddNoReturns(out, points);
}

// Merges the parts into `out`, which appears atomically. Returns after all data were synced to disk, so the
// parts may then be removed.
void MergeWhole(const std::vector<fs::path>& parts, const fs::path& out) {
  const fs::path coming = out.parent_path() / fmt::format(".{}.{}", out.filename().string(), ThisProcess());
  std::error_code ignored;
  try {
    fs::remove_all(coming);
    fs::create_directories(coming);
    MergeInto(parts, NameOfRun(out), coming);
    for (const fs::path& part : parts) AddLaterFindings(part, coming);
    SyncToDisk(coming, syncfs);
    if (rename(coming.c_str(), out.c_str()) != 0) ThrowFileError("cannot write " + out.string(), errno);
    SyncToDisk(out.parent_path(), syncfs);
  } catch (...) {
    fs::remove_all(coming, ignored);
    throw;
  }
}

struct PlannedRun {
  std::string policy, task;
  std::vector<Shard> shards;
};

std::vector<PlannedRun> RunsOf(const Plan& plan) {
  std::vector<PlannedRun> runs;
  for (Shard& shard : ShardsOf(plan)) {
    if (runs.empty() || runs.back().policy != shard.policy || runs.back().task != shard.task) {
      runs.push_back({shard.policy, shard.task, {}});
    }
    runs.back().shards.push_back(std::move(shard));
  }
  return runs;
}

// Checks the parts of a merged run that have not been removed yet.
void CheckMergedRun(const PlanFolder& folder, const PlannedRun& run, Checked* checked) {
  const results::RecordedRun merged = results::ReadRun(folder.run_folder(run.policy, run.task));
  CheckIsOfPlan(merged, folder.plan(), run.policy, run.task);
  checked->CheckEngine(merged);
  for (const Shard& shard : run.shards) {
    const fs::path part = folder.shard_folder(shard);
    try {
      if (!fs::exists(part)) continue;
      CheckIsMerged(shard, part, merged);
      checked->shards.insert(shard.name());
    } catch (const std::exception&) {
      // Another merge has removed the part in the meantime.
      if (fs::exists(part)) throw;
    }
  }
}

// Checks the shards that will be merged or removed, and adds their names to `checked`. Returns the missing
// shards. If there are any, the run's shards are neither checked nor merged. Throws InputError.
std::vector<Shard> CheckRun(const PlanFolder& folder, const PlannedRun& run, Checked* checked) {
  std::vector<Shard> missing;
  std::ranges::copy_if(run.shards, std::back_inserter(missing),
                       [&](const Shard& shard) { return !folder.has(shard); });
  if (!missing.empty()) return missing;
  try {
    if (!folder.has_run(run.policy, run.task)) {
      for (const Shard& shard : run.shards) CheckPart(folder, shard, checked);
      for (const Shard& shard : run.shards) checked->shards.insert(shard.name());
      return {};
    }
  } catch (const std::exception&) {
    // Another merge finished first and has removed the parts.
    if (!folder.has_run(run.policy, run.task)) throw;
  }
  CheckMergedRun(folder, run, checked);
  return {};
}

// Removes a merged part. For other processes, it disappears atomically.
void RemovePart(const PlanFolder& folder, const Shard& shard) {
  const fs::path part = folder.shard_folder(shard);
  const fs::path hidden = part.parent_path() / fmt::format(".{}.{}.merged", shard.name(), ThisProcess());
  std::error_code ignored;
  if (rename(part.c_str(), hidden.c_str()) == 0) fs::remove_all(hidden, ignored);
}

// Returns true if the process that wrote a file or folder has ended. Any process counts as ended if it has
// not modified the file or folder for kLongestMerge; for a process of another machine, this is the only sign.
bool IsLeft(const std::string& process, const fs::path& path) {
  constexpr auto kLongestMerge = std::chrono::hours(24);
  if (HasEnded(process)) return true;
  // Time stamps of files are compared with this machine's clock, which may differ by some minutes.
  std::error_code gone;
  const auto changed = fs::last_write_time(path, gone);
  return !gone && fs::file_time_type::clock::now() - changed > kLongestMerge;
}

// Splits ".RUN.HOST-PID", the name of an unfinished copy of a run, into the run and the process. Names of
// runs and hosts may contain dots, and one run's name may be a prefix of another's.
std::pair<const PlannedRun*, std::string> ParseCopy(const std::string& name,
                                                    const std::vector<PlannedRun>& runs,
                                                    const std::string& policy) {
  std::pair<const PlannedRun*, std::string> found{};
  size_t longest = 0;
  for (const PlannedRun& run : runs) {
    const std::string start = "." + FolderOfTask(run.task) + ".";
    if (run.policy != policy || !name.starts_with(start) || start.size() <= longest) continue;
    longest = start.size();
    found = {&run, name.substr(longest)};
  }
  return found;
}

// Removes unfinished copies of runs and partially written files that killed merges left behind.
void RemoveLeftovers(const PlanFolder& folder, const std::vector<PlannedRun>& runs) {
  std::vector<fs::path> left;
  const auto look = [&](const fs::path& path, const auto& is_left) {
    std::error_code gone;
    for (const auto& entry : fs::directory_iterator(path, gone)) {
      const auto temporary = ParseTemporaryName(entry.path().filename());
      const bool is_file =
          temporary && (temporary->file.ends_with(".json") || temporary->file.ends_with(".html"));
      if (is_file ? IsLeft(temporary->process, entry.path()) : is_left(entry.path()))
        left.push_back(entry.path());
    }
  };
  look(folder.path(), [](const fs::path&) { return false; });
  for (const PlannedPolicy& policy : folder.plan().policies) {
    look(folder.policy_folder(policy.name), [&](const fs::path& path) {
      const auto [run, process] = ParseCopy(path.filename(), runs, policy.name);
      // A copy of a run that has already been merged is not needed. If another merge is still writing this
      // copy, it will find the merged run and succeed.
      return run && (folder.has_run(run->policy, run->task) || IsLeft(process, path));
    });
  }
  std::set<std::string> merged;
  for (const PlannedRun& run : runs) {
    if (!folder.has_run(run.policy, run.task)) continue;
    for (const Shard& shard : run.shards) merged.insert(shard.name());
  }
  look(folder.path() / kPartsFolder,
       [&](const fs::path& path) { return merged.contains(ParseHidden(path.filename()).first); });
  std::error_code gone;
  for (const fs::path& path : left) fs::remove_all(path, gone);
}

}  // namespace

void MergeRuns(const std::vector<fs::path>& parts, const fs::path& out) {
  for (const fs::path& part : parts) {
    const results::RecordedRun run = results::ReadRun(part);
    if (fs::exists(part / kCollectJson)) {
      throw InputError(part.string() +
                       ": collected demonstrations: only successes were kept, so they cannot be merged");
    }
    for (const results::RecordedEpisode& episode : run.episodes) results::CheckLog(run, episode);
  }
  MergeWhole(parts, out);
}

std::vector<Shard> MergePlan(const PlanFolder& folder) {
  folder.CheckNoneIsInterrupted();
  const std::vector<PlannedRun> runs = RunsOf(folder.plan());
  // All runs are checked before the folder is changed.
  Checked checked(runs.size() * static_cast<size_t>(folder.plan().options.episodes));
  std::vector<Shard> missing;
  std::vector<const PlannedRun*> to_merge;
  for (const PlannedRun& run : runs) {
    const std::vector<Shard> still_missing = CheckRun(folder, run, &checked);
    missing.insert(missing.end(), still_missing.begin(), still_missing.end());
    if (still_missing.empty()) to_merge.push_back(&run);
  }
  checked.line.Clear();
  for (const PlannedRun* run : to_merge) {
    if (folder.has_run(run->policy, run->task)) continue;
    std::vector<fs::path> parts;
    for (const Shard& shard : run->shards) parts.push_back(folder.shard_folder(shard));
    try {
      MergeWhole(parts, folder.run_folder(run->policy, run->task));
    } catch (const std::exception&) {
      // Another merge finished first, and may have removed the parts.
      if (!folder.has_run(run->policy, run->task)) throw;
    }
  }
  for (const PlannedPolicy& policy : folder.plan().policies) {
    results::SuiteTally tally;
    bool is_whole = true;
    for (const std::string& task : folder.plan().tasks) {
      is_whole &= folder.has_run(policy.name, task);
      if (is_whole) tally.Add(task, results::ReadRun(folder.run_folder(policy.name, task)));
    }
    if (!is_whole) continue;
    const fs::path suite = folder.policy_folder(policy.name);
    ordered_json folders = ordered_json::array();
    for (const std::string& task : folder.plan().tasks) folders.push_back(FolderOfTask(task));
    ordered_json json = {{"runs", folders}};
    json.update(OptionsJson(folder.plan().OptionsOf(policy)));
    WriteWhole(suite / kSuiteJson, ToText(json, 2) + "\n");
    WriteWhole(suite / kSummaryJson, ToText(tally.Json(folder.plan().tasks), 2) + "\n");
  }
  for (const PlannedRun& run : runs) {
    if (!folder.has_run(run.policy, run.task)) continue;
    for (const Shard& shard : run.shards) {
      if (checked.shards.contains(shard.name())) RemovePart(folder, shard);
    }
  }
  RemoveLeftovers(folder, runs);
  return missing;
}

}  // namespace evalbus::plans
