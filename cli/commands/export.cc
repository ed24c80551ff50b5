// evalbus export: the episodes of a run, or of a suite, as a table or as a training set for other programs.

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/launch/film_progress.h"
#include "cli/results/episode_logs.h"
#include "cli/results/episode_table.h"
#include "cli/results/run_reader.h"
#include "cli/results/training_set.h"
#include "viz/pictures/renderer.h"

namespace evalbus::commands {
namespace {

using std::chrono::steady_clock;
namespace fs = std::filesystem;

struct ExportOptions {
  fs::path run;
  fs::path csv, hdf5, safetensors;
  std::vector<std::string> cameras;
  std::string size = "256x256";
  bool only_successes = false;
};

void AddOptions(CLI::App* app, ExportOptions* options) {
  app->add_option("run", options->run, "folder of a run or of a suite")->required();
  auto* kinds = app->add_option_group("what to write");
  kinds->add_option("--csv", options->csv, "table; one row per finished episode")->type_name("FILE");
  kinds->add_option("--hdf5", options->hdf5, "training set in robomimic's layout")->type_name("FILE");
  kinds
      ->add_option("--safetensors", options->safetensors,
                   "training set in RoboEval's layout, a file per episode")
      ->type_name("FOLDER");
  kinds->require_option(1);
  app->add_flag("--successes", options->only_successes, "training sets: episodes that succeeded only");
  app->add_option("--camera", options->cameras,
                  "--hdf5: pictures of these cameras, with commas, drawn from the logs")
      ->delimiter(',')
      ->allow_extra_args(false);
  app->add_option("--size", options->size, "--hdf5: WIDTHxHEIGHT of pictures")->capture_default_str();
}

int ExportTable(const ExportOptions& options) {
  const results::RecordedRuns runs = results::ReadRuns(options.run);
  const std::string table = results::EpisodeTable(runs.runs);
  WriteWhole(options.csv, table);
  size_t episodes = 0;
  for (const results::RecordedRun& run : runs.runs) episodes += run.episodes.size();
  fmt::print("{} episode{}  {}\n", episodes, episodes == 1 ? "" : "s", options.csv.string());
  for (const results::RecordedRun& run : runs.runs) {
    for (const std::string& remark : run.Remarks()) fmt::print("note: {}: {}\n", run.name, remark);
  }
  return 0;
}

// Logs of episodes that are complete, and succeeded where only those are wanted.
std::vector<fs::path> LogsFor(const ExportOptions& options, size_t* left_out) {
  const results::RecordedRuns runs = results::ReadRuns(options.run);
  std::vector<fs::path> logs;
  for (const results::RecordedRun& run : runs.runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      if (!episode.complete || (options.only_successes && !episode.success)) {
        ++*left_out;
        continue;
      }
      logs.push_back(EpisodeLog(run.folder, episode.episode));
    }
  }
  if (logs.empty()) throw InputError(options.run.string() + ": no episode to learn from");
  return logs;
}

int ExportTrainingSet(const ExportOptions& options) {
  const fs::path& out = options.hdf5.empty() ? options.safetensors : options.hdf5;
  if (fs::exists(out)) throw InputError(out.string() + ": exists; choose another name");
  if (!options.cameras.empty() && options.hdf5.empty()) throw InputError("--camera: only with --hdf5");
  const viz::FrameSize size = viz::ParseFrameSize(options.size);
  size_t left_out = 0;
  const std::vector<fs::path> logs = LogsFor(options, &left_out);
  launch::FilmProgress shown(logs.size(), 0, steady_clock::now());
  steady_clock::time_point last{};
  const bool is_terminal = isatty(STDOUT_FILENO) != 0;
  const auto progress = [&](double share) {
    const auto now = steady_clock::now();
    if (!is_terminal || now - last < std::chrono::milliseconds(200)) return;
    last = now;
    fmt::print("\x1b[K{}\r", shown.Text(share * static_cast<double>(logs.size()), now));
    std::fflush(stdout);
  };
  if (options.hdf5.empty()) {
    results::WriteSafetensors(logs, out, progress);
  } else {
    results::WriteRobomimic(logs, out, {options.cameras, size.width, size.height}, progress);
  }
  if (is_terminal) fmt::print("\x1b[K");
  fmt::print("{} episode{}{}  {}\n", logs.size(), logs.size() == 1 ? "" : "s",
             left_out > 0 ? fmt::format(" ({} left out)", left_out) : "", out.string());
  return 0;
}

}  // namespace

Action AddExport(CLI::App* app) {
  const auto options = std::make_shared<ExportOptions>();
  AddOptions(app, options.get());
  return [options] { return options->csv.empty() ? ExportTrainingSet(*options) : ExportTable(*options); };
}

}  // namespace evalbus::commands
