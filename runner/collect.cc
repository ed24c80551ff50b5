#include "runner/collect.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "bus/private_network.h"
#include "models/task_family.h"
#include "results/run_folder.h"
#include "results/run_reader.h"
#include "results/run_summary.h"
#include "results/summary_table.h"
#include "runner/prepared_run.h"
#include "runner/run.h"
#include "runner/strata.h"
#include "sim/prepared_scene.h"
#include "sim/world.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;

// Number of starts that are drawn per requested success. This is also the maximum number of starts that are
// tried per group of neighbors.
constexpr int kStartsEach = 8;

// Returns the start of each episode: the values of the variation's parameters.
std::vector<std::vector<double>> Starts(const RunOptions& options, int episodes) {
  const sim::PreparedScene prepared = sim::ComposeScene(options.sim);
  sim::World world(prepared.scene.physics.get(), prepared.info, prepared.robot, prepared.task,
                   prepared.info.substeps);
  const Variation& variation = prepared.task.variation(prepared.variation);
  const SeedSource seeds{options.seed, options.sim.seed_stream, FamilyOf(prepared.task.name),
                         prepared.variation};
  std::vector<std::vector<double>> starts;
  for (int episode = 0; episode < episodes; ++episode) {
    std::vector<double>& start = starts.emplace_back();
    for (const Parameter& parameter : world.Reset(seeds.OfEpisode(episode), variation)) {
      start.push_back(parameter.value);
    }
    // All starts need the same number of values, which may differ if the scene has optional distractors.
    start.resize(starts[0].size());
  }
  return starts;
}

std::set<int> Successes(const fs::path& folder) {
  std::set<int> episodes;
  for (const results::RecordedEpisode& episode : results::ReadRunAsFarAsItGot(folder).episodes) {
    if (episode.success && episode.complete) episodes.insert(episode.episode);
  }
  return episodes;
}

// Returns the index of the kept start in its group; the group's size if there is none.
size_t PlaceOfKept(const std::vector<int>& stratum, const std::set<int>& kept) {
  const auto found = std::ranges::find_if(stratum, [&](int episode) { return kept.contains(episode); });
  return static_cast<size_t>(found - stratum.begin());
}

// Throws InputError if the collection in the folder has different options.
void CheckCollection(const RunOptions& options, int wanted) {
  const results::RecordedRun before = results::ReadRunInfo(options.out);
  if (before.seed_stream != kCollectSeeds)
    throw InputError("--resume: " + options.out.string() +
                     " is the folder of a run, expected that of a collection");
  if (before.planned != options.episodes) {
    throw InputError(fmt::format("--resume: {} was collected with --episodes {}, not {}",
                                 options.out.string(), before.planned / kStartsEach, wanted));
  }
  PrepareRun(options);
}

}  // namespace

void Collect(RunOptions options) {
  const int wanted = options.episodes;
  options.sim.seed_stream = kCollectSeeds;
  options.episodes = wanted * kStartsEach;
  options.sim.task = options.tasks.at(0);
  const std::string& task = options.sim.task;
  if (task == "all" || task.ends_with("/all") || task.find(',') != std::string::npos) {
    throw InputError("collect: expected one task with one variation, such as lift_pot/position, not '" +
                     task + "'");
  }
  const auto strata = Strata(Starts(options, options.episodes), wanted);
  // Run() removes the environment variable, so without this option only the first round would use its bus.
  if (options.url.empty() && !options.in_process && options.workers == 1) options.url = UrlOfEnvironment();

  const fs::path folder = options.out;
  // The first success of each group. A group has another one if a later start was run together with an
  // earlier start that had become invalid because the policy's server failed.
  std::set<int> kept;
  bool is_complete = false;
  if (options.resume && fs::exists(folder / kRunJson)) {
    CheckCollection(options, wanted);
    kept = FirstOfEach(strata, Successes(folder));
    is_complete = fs::exists(folder / kCollectJson);
  }
  for (int round = 0; round < kStartsEach && !is_complete; ++round) {
    // Adds one start to each group without a success.
    std::vector<int> starts;
    int next = 0;
    for (const std::vector<int>& stratum : strata) {
      if (PlaceOfKept(stratum, kept) < stratum.size()) continue;
      starts.insert(starts.end(), stratum.begin(), stratum.begin() + round + 1);
      ++next;
    }
    if (next == 0) break;
    if (round > 0) {
      fmt::print("{} of {} starts failed: trying neighboring starts, attempt {} of {}\n", next, wanted,
                 round + 1, kStartsEach);
    }
    std::ranges::sort(starts);
    options.only = starts;
    options.round = round;
    Run(options);
    options.resume = true;
    kept = FirstOfEach(strata, Successes(folder));
  }

  // The following steps may be interrupted at any point and repeated with the same result. The lines of
  // failures are removed early, so the number of tried starts is derived from the groups. collect.json marks
  // a complete collection, so it is written last.
  const results::RunFolder run = results::RunFolder::OfRun(folder, "collect", true);
  size_t tried = 0;
  for (const std::vector<int>& stratum : strata) {
    tried += std::min(PlaceOfKept(stratum, kept) + 1, stratum.size());
  }
  // The yield is not a success rate, because failed starts are replaced by neighboring starts.
  const std::string failures = results::FailuresText(results::WriteRunSummary(folder).statistics);
  std::vector<nlohmann::ordered_json> lines;
  for (const results::RecordedEpisode& episode : results::ReadRunAsFarAsItGot(folder).episodes) {
    if (kept.contains(episode.episode)) lines.push_back(episode.Json());
  }
  run.WriteEpisodes(lines);
  run.DiscardAllBut(kept);
  results::WriteRunSummary(folder);
  const double yield = static_cast<double>(kept.size()) / static_cast<double>(tried);
  run.WriteJson(kCollectJson, {{"wanted", wanted},
                               {"kept", kept.size()},
                               {"tried", tried},
                               {"yield", yield},
                               {"seed", options.seed},
                               {"seed_stream", options.sim.seed_stream},
                               {"starts_drawn", options.episodes}});
  fmt::print("\nkept {} of {} requested, {} attempted: yield {:.1f} %\n", kept.size(), wanted, tried,
             100 * yield);
  if (!failures.empty()) fmt::print("not kept        {}\n", failures);
  fmt::print("demonstrations  {}\n", (run.shown() / kEpisodesFolder).string());
  if (static_cast<int>(kept.size()) < wanted) {
    throw EnvironmentError(fmt::format("{} of {} starts failed {} times each",
                                       wanted - static_cast<int>(kept.size()), wanted, kStartsEach));
  }
}

}  // namespace evalbus::runner
