// Implements `evalbus why`, which finds the start parameters that influence success, and the points of no
// return of failed episodes.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "policy_bridge/experts/expert.h"
#include "results/circumstances.h"
#include "results/circumstances_text.h"
#include "results/found_runs.h"
#include "results/no_return.h"
#include "results/run_reader.h"
#include "runner/no_return_finder.h"
#include "runner/progress_line.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct WhyOptions {
  std::vector<fs::path> runs;
  // Episodes whose point of no return is searched for. If `failures` is true, these are all failures.
  std::vector<int> episodes;
  bool failures = false;
  // Task whose expert takes over; empty: the task of each run.
  std::string expert;
  // JSON file to write; empty: none.
  fs::path json;
};

// Reads all runs with finished episodes in these folders of runs, suites and plans.
std::vector<results::RecordedRun> ReadAll(const std::vector<fs::path>& folders) {
  std::vector<results::RecordedRun> runs;
  std::set<fs::path> read;
  for (const fs::path& folder : folders) {
    const size_t before = runs.size();
    for (const results::FoundRun& found : results::FindRuns(folder).runs) {
      if (!fs::exists(found.folder / kEpisodesJsonl)) continue;
      if (!read.insert(fs::weakly_canonical(found.folder)).second)
        throw InputError(found.folder.string() + ": given twice");
      runs.push_back(results::ReadRun(found.folder));
      runs.back().name = found.name;
    }
    if (runs.size() == before) throw InputError(folder.string() + ": no finished episode");
  }
  return runs;
}

std::vector<int> FailedEpisodes(const results::RecordedRun& run) {
  std::vector<int> failed;
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (episode.complete && episode.judged() && !episode.success) failed.push_back(episode.episode);
  }
  return failed;
}

// Throws InputError unless --episode names failed episodes of a single run.
void CheckEpisodes(const std::vector<results::RecordedRun>& runs, const std::vector<int>& episodes) {
  if (episodes.empty()) return;
  if (runs.size() != 1) throw InputError("--episode: expected one run");
  const std::vector<int> failed = FailedEpisodes(runs[0]);
  for (const int episode : episodes) {
    if (std::ranges::find(failed, episode) != failed.end()) continue;
    throw InputError(
        fmt::format("--episode {}: expected a failed episode of {}: {}", episode, runs[0].folder.string(),
                    failed.empty() ? "it has none" : fmt::format("{}", fmt::join(failed, ", "))));
  }
}

// Prints the causes of failed episodes, without an empty line before them if they are the first output.
void PrintCauses(const results::RecordedRun& run, const std::vector<int>& wanted, bool is_first) {
  if (wanted.empty()) return;
  fmt::print("{}episode  cause\n", is_first ? "" : "\n");
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (std::ranges::find(wanted, episode.episode) == wanted.end()) continue;
    const std::string& text = episode.cause.text;
    fmt::print("{:>7}  {}\n", episode.episode, Printable(text.empty() ? episode.explanation : text));
  }
  std::fflush(stdout);
}

// Finds points of no return and adds them to the run's no_return.json. Throws InputError or EnvironmentError.
void FindNoReturns(const results::RecordedRun& run, const std::vector<int>& wanted,
                   const std::string& expert) {
  runner::NoReturnFinder finder(run, expert);
  runner::ProgressLine line(wanted.size(), "searching");
  for (size_t k = 0; k < wanted.size(); ++k) {
    line.Show(static_cast<double>(k));
    results::AddNoReturns(run.folder, {{wanted[k], finder.Find(wanted[k])}});
  }
}

void PrintNoReturns(const results::RecordedRun& run, const std::string& expert) {
  const results::NoReturns points = results::ReadNoReturns(run.folder);
  if (!points.empty()) fmt::print("\nepisode  point of no return\n");
  for (const auto& [episode, point] : points)
    fmt::print("{:>7}  {}\n", episode, results::NoReturnText(point));
  const bool is_complete =
      std::ranges::all_of(FailedEpisodes(run), [&](int episode) { return points.contains(episode); });
  if (is_complete || !policy::HasExpert(expert.empty() ? run.task : expert)) return;
  std::vector<std::string> command = {"evalbus", "why", run.folder.string(), "--failures"};
  if (!expert.empty()) command.insert(command.end(), {"--expert", expert});
  fmt::print("\n{}: {}\n", points.empty() ? "points of no return" : "those of all failures",
             ShellWords(command));
}

// Returns the exit code, which is always 0. Throws InputError or EnvironmentError.
int Explain(const WhyOptions& options) {
  const std::vector<results::RecordedRun> runs = ReadAll(options.runs);
  CheckEpisodes(runs, options.episodes);
  if (!options.expert.empty()) policy::CheckExpert(options.expert, {"--expert", "--expert TASK"});
  std::vector<const results::RecordedRun*> all;
  for (const results::RecordedRun& run : runs) all.push_back(&run);
  const std::vector<results::RunCircumstances> found = results::FindCircumstances(all);
  // The causes of episodes that the user names are the answer to the question, so they are printed first.
  const bool are_named = !options.episodes.empty();
  for (size_t i = 0; i < found.size(); ++i) {
    const std::vector<int> wanted = options.failures ? FailedEpisodes(runs[i]) : options.episodes;
    if (are_named) PrintCauses(runs[i], wanted, true);
    fmt::print("{}{}", i == 0 && !are_named ? "" : "\n",
               results::CircumstancesText(found[i], UsesColors(stdout)));
    if (!are_named) PrintCauses(runs[i], wanted, false);
    if (!wanted.empty()) FindNoReturns(runs[i], wanted, options.expert);
    PrintNoReturns(runs[i], options.expert);
  }
  if (!options.json.empty()) {
    nlohmann::ordered_json json = results::CircumstancesJson(found);
    for (size_t i = 0; i < runs.size(); ++i)
      json[i]["no_return"] = results::NoReturnsJson(results::ReadNoReturns(runs[i].folder));
    WriteWhole(options.json, ToText(json, 2) + "\n");
    fmt::print("\njson     {}\n", options.json.string());
  }
  return 0;
}

}  // namespace

Action AddWhy(CLI::App* app) {
  const auto options = std::make_shared<WhyOptions>();
  app->add_option("runs", options->runs, "folders of runs, suites or plans")->required();
  AddList(
      app, "--episode", &options->episodes,
      "also print the cause of these failed episodes, and find the point of no return: the last tick from "
      "which the\nexpert still succeeds; it is kept in RUN/no_return.json, for the page and the report")
      ->excludes(app->add_flag("--failures", options->failures, "the same for all failed episodes"));
  app->add_option("--expert", options->expert,
                  "task whose expert is used, if the run's task is a copy of it, for example lift_pot");
  app->add_option("--json", options->json, "also write the results to this file, as JSON")
      ->check(CheckOutputFile);
  return [options] { return Explain(*options); };
}

}  // namespace evalbus::commands
