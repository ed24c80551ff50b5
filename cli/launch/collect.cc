#include "cli/launch/collect.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "cli/launch/run.h"
#include "cli/launch/strata.h"
#include "cli/results/run_folder.h"
#include "cli/results/run_reader.h"
#include "cli/results/run_summary.h"
#include "cli/results/summary_table.h"
#include "sim/prepared_scene.h"
#include "sim/world.h"

namespace evalbus::launch {
namespace {

namespace fs = std::filesystem;

// Starts that are drawn for each that is wanted: as often a start may be replaced by a neighbour where it
// fails.
constexpr int kStartsEach = 8;

// Where each of so many episodes of the run begins: what its variation draws.
std::vector<std::vector<double>> Starts(const RunOptions& options, int episodes) {
  const sim::PreparedScene prepared = sim::ComposeScene(options.sim);
  sim::World world(prepared.scene.physics.get(), prepared.info, prepared.robot, prepared.task,
                   prepared.info.substeps);
  const Variation& variation = prepared.task.variation(prepared.variation);
  const SeedSource seeds{options.seed, options.seed_stream, prepared.task.name, prepared.variation};
  std::vector<std::vector<double>> starts;
  for (int episode = 0; episode < episodes; ++episode) {
    std::vector<double>& start = starts.emplace_back();
    for (const Parameter& parameter : world.Reset(seeds.OfEpisode(episode), variation)) {
      start.push_back(parameter.value);
    }
    // Distractors that are there or not make their number another one.
    start.resize(starts[0].size());
  }
  return starts;
}

}  // namespace

void Collect(RunOptions options) {
  if (options.resume && fs::exists(options.out / kCollectJson)) {
    throw InputError("--resume: " + options.out.string() + ": is complete");
  }
  const int wanted = options.episodes;
  options.seed_stream = kCollectSeeds;
  options.episodes = wanted * kStartsEach;
  options.sim.task = options.tasks.at(0);
  const auto strata = Strata(Starts(options, options.episodes), wanted);

  std::vector<int> tried;
  std::set<int> kept;
  fs::path folder = options.out;
  for (int round = 0; round < kStartsEach && static_cast<int>(kept.size()) < wanted; ++round) {
    // Of each group that has no success yet, the next start.
    std::vector<int> next;
    for (const std::vector<int>& stratum : strata) {
      if (std::ranges::any_of(stratum, [&](int episode) { return kept.contains(episode); })) continue;
      next.push_back(stratum[static_cast<size_t>(round)]);
    }
    if (round > 0) {
      fmt::print("{} of {} starts failed: their neighbours, try {} of {}\n", next.size(), wanted, round + 1,
                 kStartsEach);
    }
    tried.insert(tried.end(), next.begin(), next.end());
    std::ranges::sort(tried);
    options.only = tried;
    options.round = round;
    Run(options);
    options.resume = true;
    for (const results::RecordedEpisode& episode : results::ReadRun(folder).episodes) {
      if (episode.success && episode.complete) kept.insert(episode.episode);
    }
  }

  // No rate: starts that fail are tried near by again.
  const std::string failures = results::FailuresText(results::WriteRunSummary(folder).statistics);
  const results::RunFolder run = results::RunFolder::OfRun(folder, "collect", true);
  std::vector<nlohmann::ordered_json> lines;
  for (const results::RecordedEpisode& episode : results::ReadRun(folder).episodes) {
    if (kept.contains(episode.episode)) lines.push_back(episode.Json());
  }
  run.WriteEpisodes(lines);
  run.DiscardAllBut(kept);
  const double yield = static_cast<double>(kept.size()) / static_cast<double>(tried.size());
  run.WriteJson(kCollectJson, {{"wanted", wanted},
                               {"kept", kept.size()},
                               {"tried", tried.size()},
                               {"yield", yield},
                               {"seed", options.seed},
                               {"seed_stream", options.seed_stream},
                               {"starts_drawn", options.episodes}});
  if (!kept.empty()) results::WriteRunSummary(folder);
  fmt::print("\nkept {} of {} wanted, of {} tried: yield {:.1f} %\n", kept.size(), wanted, tried.size(),
             100 * yield);
  if (!failures.empty()) fmt::print("not kept        {}\n", failures);
  fmt::print("demonstrations  {}\n", (run.shown() / kEpisodesFolder).string());
  if (static_cast<int>(kept.size()) < wanted) {
    throw EnvironmentError(fmt::format("{} of {} starts failed {} times each",
                                       wanted - static_cast<int>(kept.size()), wanted, kStartsEach));
  }
}

}  // namespace evalbus::launch
