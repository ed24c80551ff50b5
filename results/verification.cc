#include "results/verification.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "results/kept_results.h"
#include "results/log_check.h"
#include "results/manifest.h"
#include "results/rescorer.h"
#include "results/run_reader.h"
#include "results/run_summary.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void AddFinding(Verification* result, const std::string& finding) {
  // A file that cannot be read may be needed several times but is reported once.
  if (std::ranges::find(result->findings, finding) == result->findings.end())
    result->findings.push_back(finding);
}

// Calls check(). If it throws InputError, adds the error to the findings.
template <class Check>
void Collect(Verification* result, const Check& check) {
  try {
    check();
  } catch (const InputError& error) {
    AddFinding(result, error.what());
  }
}

void CheckFolderKind(const fs::path& folder) {
  if (IsResultsFolder(folder)) return;
  throw InputError(folder.string() +
                   (fs::exists(folder) ? ": neither a run, a suite nor a plan" : ": no such run folder"));
}

// Adds a finding for each value that differs. where: origin of the computed value.
void AddDifferences(const fs::path& file, const ordered_json& stored, const ordered_json& computed,
                    const std::string& where, Verification* result) {
  for (const Difference& one : Differences(stored, ordered_json::parse(ToText(computed)))) {
    result->findings.push_back(
        fmt::format("{}: {} is {}, {} {}", file.string(), one.name, one.before, where, one.after));
  }
}

void CheckHash(const fs::path& file, const RecordedRun& run, const char* key, const std::string& found,
               Verification* result) {
  const auto recorded = run.info.find(key);
  if (recorded == run.info.end() || *recorded == found) return;
  result->findings.push_back(fmt::format("{}: does not belong to this run: its SHA-256 differs from {} in {}",
                                         file.string(), key, kRunJson));
}

void CheckScore(const RecordedRun& run, const fs::path& log, KeptResults* kept, Rescorer* rescorer,
                Verification* result) {
  const RescoredLog scored = rescorer->Rescore(log);
  if (scored.damaged_places > 0) {
    result->findings.push_back(
        fmt::format("{}: damaged: {} bytes cannot be read", log.string(), scored.damaged_bytes));
  }
  if (scored.decode_errors > 0) {
    result->findings.push_back(
        fmt::format("{}: {} cannot be decoded", log.string(), Plural(scored.decode_errors, "message")));
  }
  if (scored.episodes.size() != 1) {
    result->findings.push_back(fmt::format("{}: {}, expected 1", log.string(),
                                           Plural(static_cast<int64_t>(scored.episodes.size()), "episode")));
    return;
  }
  const RescoredEpisode& episode = scored.episodes[0];
  for (const std::string& difference : ModelDifferences(run, *episode.model))
    result->findings.push_back(
        fmt::format("{}: does not belong to this run: {}: {}", log.string(), kRunJson, difference));
  if (!episode.equal()) {
    result->findings.push_back(
        log.string() + ": its score " +
        (episode.recorded ? "differs: " + DifferencesText(Differences(*episode.recorded, episode.summary))
                          : "is missing"));
  }
  if (const std::string difference = kept->Difference(log, episode); !difference.empty())
    result->findings.push_back(log.string() + ": " + difference);
}

void CheckEpisode(const RecordedRun& run, const RecordedEpisode& episode, KeptResults* kept,
                  Rescorer* rescorer, Verification* result) {
  ++result->episodes;
  const fs::path folder = EpisodeFolder(run.folder, episode.episode), log = LogIn(folder);
  // A missing log is reported by KeptResults::Missing().
  if (fs::exists(log)) Collect(result, [&] { CheckScore(run, log, kept, rescorer, result); });
  const fs::path summary = folder / kSummaryJson;
  if (!fs::exists(summary)) return;
  Collect(result, [&] {
    AddDifferences(summary, ReadJsonFile<ordered_json>(summary), episode.Json(), "in episodes.jsonl", result);
  });
}

void CheckRun(const fs::path& folder, Verification* result) {
  ++result->runs;
  std::optional<RecordedRun> run;
  std::optional<KeptResults> kept;
  Collect(result, [&] {
    run = ReadRunAsFarAsItGot(folder);
    kept.emplace(folder);
  });
  if (!run || !kept) return;
  result->versions.insert(fmt::format("{} ({})", run->info.value("evalbus_version", "unknown"),
                                      run->info.value("git_commit", "unknown")));
  for (const auto& [file, key] :
       {std::pair(kPhysicsModel, "physics_sha256"), std::pair(kVisualModel, "visual_sha256")}) {
    const fs::path model = folder / kModelFolder / file;
    if (fs::exists(model))
      Collect(result, [&, key = key] { CheckHash(model, *run, key, Sha256File(model), result); });
  }
  Rescorer rescorer;
  for (const RecordedEpisode& episode : run->episodes) CheckEpisode(*run, episode, &*kept, &rescorer, result);
  for (const fs::path& log : kept->Missing()) {
    if (!fs::exists(log))
      result->findings.push_back(log.string() + ": missing; episodes.jsonl has its score");
  }
  std::set<int> scored;
  for (const RecordedEpisode& episode : run->episodes) scored.insert(episode.episode);
  for (const fs::path& other : EpisodeFolders(folder)) {
    if (!IsUnfinished(other) && !scored.contains(*EpisodeOfFolder(other)))
      result->findings.push_back(fmt::format("{}: {} lacks this episode", other.string(), kEpisodesJsonl));
  }
  const fs::path summary = folder / kSummaryJson;
  if (!fs::exists(summary)) {
    result->notes.push_back(summary.string() + ": missing: the run has not ended");
    return;
  }
  if (run->episodes.size() < static_cast<size_t>(run->num_planned()) && !run->is_collection()) {
    result->notes.push_back(fmt::format("{}: {} of {} episodes have finished", folder.string(),
                                        run->episodes.size(), run->num_planned()));
  }
  Collect(result, [&] {
    AddDifferences(summary, ReadJsonFile<ordered_json>(summary), RunSummaryJson(*run), "recomputed", result);
  });
}

bool WasInterrupted(const RecordedRuns& suite) {
  return !suite.missing.empty() || std::ranges::any_of(suite.runs, [](const RecordedRun& run) {
    return run.episodes.size() < static_cast<size_t>(run.num_planned());
  });
}

void CheckSuite(const fs::path& folder, Verification* result) {
  const fs::path file = folder / kSummaryJson;
  if (!fs::exists(file)) {
    result->notes.push_back(file.string() + ": missing: the suite has not ended");
    return;
  }
  Collect(result, [&] {
    const auto stored = ReadJsonFile<ordered_json>(file);
    // The keys of "by_variation" are the tasks as the user named them, in the order of the runs.
    std::vector<std::string> names;
    const auto tasks = stored.value("by_variation", ordered_json::object());
    for (const auto& [name, value] : tasks.items()) names.push_back(name);
    const auto has_episodes = [&](const std::string& run) {
      return fs::exists(folder / run / kEpisodesJsonl);
    };
    if (names.empty() && std::ranges::none_of(RunsInSuite(folder), has_episodes)) {
      result->notes.push_back(folder.string() + ": no episode has finished");
      return;
    }
    SuiteTally tally;
    const RecordedRuns suite = ReadRuns(folder);
    // An interrupted suite writes a summary of the tasks that have finished.
    if (names.size() < suite.runs.size() && WasInterrupted(suite)) {
      result->notes.push_back(fmt::format("{}: {} of {} tasks: the suite was interrupted", file.string(),
                                          names.size(), suite.runs.size()));
      return;
    }
    if (names.size() != suite.runs.size())
      throw InputError(fmt::format("{}: {} in by_variation, the suite has {}", file.string(),
                                   Plural(static_cast<int64_t>(names.size()), "task"), suite.runs.size()));
    for (size_t i = 0; i < names.size(); ++i) tally.Add(names[i], suite.runs[i]);
    AddDifferences(file, stored, tally.Json(names), "recomputed", result);
  });
}

}  // namespace

void Verification::Add(const Verification& other) {
  for (const std::string& finding : other.findings) AddFinding(this, finding);
  notes.insert(notes.end(), other.notes.begin(), other.notes.end());
  versions.insert(other.versions.begin(), other.versions.end());
  runs += other.runs;
  episodes += other.episodes;
  pages += other.pages;
  comparisons += other.comparisons;
  files += other.files;
  bytes += other.bytes;
}

namespace {

// is_noted: true if a folder above has no manifest, which is noted once.
void VerifyHashes(const fs::path& folder, bool is_noted, Verification* result) {
  CheckFolderKind(folder);
  if (fs::exists(folder / kManifestJson)) {
    Collect(result, [&] {
      ManifestCheck check = CheckManifest(folder);
      for (const std::string& finding : check.findings) AddFinding(result, finding);
      for (const std::string& file : check.added) result->notes.push_back(file + ": not in the manifest");
      result->files += check.files;
      result->bytes += check.bytes;
    });
  } else if (!std::exchange(is_noted, true)) {
    result->notes.push_back((folder / kManifestJson).string() +
                            ": missing, so changed bytes cannot be found; --write writes it");
  }
  for (const std::string& below : ContentsOf(folder).folders) VerifyHashes(folder / below, is_noted, result);
}

}  // namespace

void VerifyHashes(const fs::path& folder, Verification* result) { VerifyHashes(folder, false, result); }

void VerifyNumbers(const fs::path& folder, Verification* result) {
  CheckFolderKind(folder);
  try {
    if (fs::exists(folder / kRunJson)) CheckRun(folder, result);
    if (fs::exists(folder / kSuiteJson)) CheckSuite(folder, result);
  } catch (const nlohmann::json::exception& error) {
    AddFinding(result, fmt::format("{}: a JSON file has a value of an unexpected type: {}", folder.string(),
                                   error.what()));
  }
  for (const std::string& below : ContentsOf(folder).folders) VerifyNumbers(folder / below, result);
}

void WriteManifests(const fs::path& folder) {
  CheckFolderKind(folder);
  for (const std::string& below : ContentsOf(folder).folders) WriteManifests(folder / below);
  WriteWhole(folder / kManifestJson, ToText(MakeManifest(folder), 2) + "\n");
}

}  // namespace evalbus::results
