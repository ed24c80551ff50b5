#include "results/compared_runs.h"

#include <fmt/format.h>

#include <algorithm>

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
      throw InputError("baseline " + name + ": matches more than one run; pass a folder");
    }
    RecordedRuns baseline = std::move(*found);
    runs->erase(found);
    return baseline;
  }
  if (fs::is_directory(name)) return ReadForComparison(name);
  std::string known;
  for (const RecordedRuns& run : *runs) known += fmt::format(", {} ({})", run.name, run.runs[0].policy);
  throw InputError("baseline " + name + ": neither one of the runs nor a folder; the runs are " +
                   known.substr(2));
}

void NameApart(std::vector<RecordedRuns>* runs) {
  std::vector<std::string> names;
  for (const RecordedRuns& run : *runs) names.push_back(run.name);
  for (RecordedRuns& run : *runs) {
    if (std::ranges::count(names, run.name) > 1) run.name = run.folder.lexically_normal().string();
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
        if (seed || episode.success != other->success) return pair;
        if (!first) first = pair;
      }
    }
  }
  return first;
}

}  // namespace evalbus::results
