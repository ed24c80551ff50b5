#include "cli/plans/merge.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <set>
#include <sstream>

#include "base/errors.h"
#include "base/file_errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "cli/launch/prepared_run.h"
#include "cli/launch/suite.h"
#include "cli/results/run_reader.h"
#include "cli/results/run_summary.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Keys of run.json that say where and how much of the run was done, and not what it is.
constexpr const char* kOfAPart[] = {"only", "run_id", "url", "workers", "in_process"};

ordered_json WithoutPart(ordered_json info) {
  for (const char* key : kOfAPart) info.erase(key);
  return info;
}

// Files of a folder, by links where both are on one disk.
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

// The chunks' run folder, under a name that nobody looks for.
void MergeInto(const std::vector<fs::path>& parts, const std::string& run_id, const fs::path& out) {
  std::map<int, fs::path> owner;
  std::string lines;
  std::optional<ordered_json> info;
  for (const fs::path& part : parts) {
    const results::RecordedRun run = results::ReadRun(part);
    if (!info) {
      info = run.info;
    } else if (const ordered_json first = WithoutPart(*info), other = WithoutPart(run.info); first != other) {
      for (const auto& [key, value] : first.items()) {
        if (other.value(key, ordered_json()) == value) continue;
        throw InputError(
            fmt::format("{}: \"{}\" is {}, but {} in {}: no parts of one run", (part / kRunJson).string(),
                        key, ToText(other.value(key, ordered_json())), ToText(value), parts[0].string()));
      }
    }
    for (const results::RecordedEpisode& episode : run.episodes) {
      const auto [first, is_new] = owner.emplace(episode.episode, part);
      if (!is_new) {
        throw InputError(fmt::format("{}: episode {} is in {}, too", part.string(), episode.episode,
                                     first->second.string()));
      }
      Link(EpisodeFolder(part, episode.episode), EpisodeFolder(out, episode.episode));
      lines += episode.text + "\n";
    }
    // What the components noticed, by part.
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

}  // namespace

void MergeRuns(const std::vector<fs::path>& parts, const fs::path& out) {
  const fs::path coming = out.parent_path() / fmt::format(".{}.{}", out.filename().string(), ThisProcess());
  std::error_code ignored;
  try {
    fs::create_directories(coming);
    MergeInto(parts, NameOfRun(out), coming);
    if (rename(coming.c_str(), out.c_str()) != 0) ThrowFileError("cannot write " + out.string(), errno);
  } catch (...) {
    fs::remove_all(coming, ignored);
    throw;
  }
}

std::vector<Chunk> MergePlan(const PlanFolder& folder) {
  std::map<std::pair<std::string, std::string>, std::vector<Chunk>> by_run;
  for (const Chunk& chunk : ChunksOf(folder.plan())) by_run[{chunk.policy, chunk.task}].push_back(chunk);
  std::vector<Chunk> missing;
  for (const auto& [run, chunks] : by_run) {
    const auto& [policy, task] = run;
    if (folder.has_run(policy, task)) continue;
    std::vector<fs::path> parts;
    for (const Chunk& chunk : chunks) {
      if (folder.has(chunk)) {
        parts.push_back(folder.chunk_folder(chunk));
      } else {
        missing.push_back(chunk);
      }
    }
    if (parts.size() < chunks.size()) continue;
    try {
      MergeRuns(parts, folder.run_folder(policy, task));
    } catch (const std::exception&) {
      // Another merge was quicker, and may have taken the parts away.
      if (!folder.has_run(policy, task)) throw;
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
    ordered_json runs = ordered_json::array();
    for (const std::string& task : folder.plan().tasks) runs.push_back(launch::FolderOfTask(task));
    ordered_json json = {{"runs", runs}};
    json.update(OptionsJson(folder.plan().OptionsOf(policy)));
    WriteWhole(suite / kSuiteJson, ToText(json, 2) + "\n");
    WriteWhole(suite / kSummaryJson, ToText(tally.Json(folder.plan().tasks), 2) + "\n");
  }
  // What was merged is there once; nor is anything left of those that were killed at it.
  std::error_code gone;
  std::set<std::string> merged;
  for (const auto& [run, chunks] : by_run) {
    if (!folder.has_run(run.first, run.second)) continue;
    for (const Chunk& chunk : chunks) {
      fs::remove_all(folder.chunk_folder(chunk), gone);
      merged.insert(chunk.name());
    }
  }
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder.path() / kPartsFolder, gone)) {
    if (merged.contains(ParseHidden(entry.path().filename()).first)) left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove_all(path, gone);
  return missing;
}

}  // namespace evalbus::plans
