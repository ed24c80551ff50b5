#include "results/compared_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/sha256.h"

namespace evalbus::results {

namespace fs = std::filesystem;

RecordedRuns ReadForComparison(const fs::path& folder) {
  RecordedRuns runs = ReadRuns(folder);
  for (RecordedRun& run : runs.runs) SetPhysicsHash(&run);
  return runs;
}

void SetPhysicsHash(RecordedRun* run) {
  run->info["physics_sha256"] = Sha256File(run->folder / kModelFolder / kPhysicsModel);
}

RecordedRuns RemoveBaseline(const std::string& name, std::vector<RecordedRuns>* runs) {
  const auto matches = [&](const RecordedRuns& run) {
    return name.empty() || run.name == name || run.runs[0].policy == name ||
           (fs::exists(name) && fs::equivalent(run.folder, name));
  };
  const auto found = std::find_if(runs->begin(), runs->end(), matches);
  if (found != runs->end()) {
    if (!name.empty() && std::find_if(found + 1, runs->end(), matches) != runs->end()) {
      throw InputError("--baseline " + name + ": matches more than one run; pass a folder");
    }
    RecordedRuns baseline = std::move(*found);
    runs->erase(found);
    return baseline;
  }
  if (fs::is_directory(name)) return ReadForComparison(name);
  std::string known;
  for (const RecordedRuns& run : *runs) known += fmt::format(", {} ({})", run.name, run.runs[0].policy);
  throw InputError("--baseline " + name + ": neither one of the runs nor a folder; the runs are " +
                   known.substr(2));
}

std::vector<std::string> DistinctNames(const std::vector<fs::path>& folders) {
  std::vector<std::vector<std::string>> parts;
  for (const fs::path& folder : folders) {
    const fs::path whole = folder.lexically_normal();
    parts.emplace_back(whole.begin(), whole.end());
  }
  const auto all_equal = [&parts](const auto& part) {
    return std::ranges::all_of(parts,
                               [&](const auto& one) { return !one.empty() && part(one) == part(parts[0]); });
  };
  while (all_equal([](const auto& one) { return one.back(); })) {
    for (auto& one : parts) one.pop_back();
  }
  while (all_equal([](const auto& one) { return one.front(); })) {
    for (auto& one : parts) one.erase(one.begin());
  }
  const bool is_short = std::ranges::none_of(parts, [](const auto& one) { return one.empty(); });
  std::vector<std::string> names;
  for (size_t i = 0; i < folders.size(); ++i) {
    fs::path name;
    for (const std::string& part : parts[i]) name /= part;
    names.push_back((is_short ? name : folders[i].lexically_normal()).string());
  }
  return names;
}

void NameApart(std::vector<RecordedRuns>* runs) {
  std::map<std::string, std::vector<RecordedRuns*>> by_name;
  for (RecordedRuns& run : *runs) by_name[run.name].push_back(&run);
  for (const auto& [name, equal] : by_name) {
    if (equal.size() < 2) continue;
    std::vector<fs::path> folders;
    for (const RecordedRuns* run : equal) folders.push_back(run->folder);
    const std::vector<std::string> names = DistinctNames(folders);
    for (size_t i = 0; i < equal.size(); ++i) equal[i]->name = names[i];
  }
}

std::optional<SeedPair> FindSeedPair(const RecordedRuns& runs, const RecordedRuns& baselines,
                                     std::optional<int64_t> seed) {
  std::optional<SeedPair> first;
  for (const RecordedRun& run : runs.runs) {
    for (const RecordedRun& baseline : baselines.runs) {
      if (run.task_name() != baseline.task_name()) continue;
      for (const RecordedEpisode& episode : run.episodes) {
        const auto other = std::ranges::find(baseline.episodes, episode.seed, &RecordedEpisode::seed);
        if (other == baseline.episodes.end() || (seed && *seed != episode.seed)) continue;
        const SeedPair pair{&run, &baseline, episode.seed, episode.episode, other->episode};
        const bool has_verdicts = episode.complete && episode.judged() && other->complete && other->judged();
        if (seed || (has_verdicts && episode.success != other->success)) return pair;
        if (!first) first = pair;
      }
    }
  }
  return first;
}

}  // namespace evalbus::results
