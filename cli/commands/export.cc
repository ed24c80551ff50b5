// evalbus export: runs for other programs: their episodes as a table, or each as an MCAP file.

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "base/errors.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/results/episode_logs.h"
#include "cli/results/episode_table.h"
#include "cli/results/run_reader.h"
#include "cli/tools/recording.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  fs::path run;
  fs::path csv;
  // Given, and perhaps without a name.
  CLI::Option* mcap = nullptr;
  fs::path mcap_file;
  std::vector<int> episodes;
  std::vector<std::string> cameras;
  std::string size = "640x480";
};

void AddOptions(CLI::App* app, ExportOptions* options) {
  app->add_option("run", options->run,
                  "folder of a run or of a suite; with --mcap also of an episode, or a log")
      ->required();
  CLI::Option* csv = app->add_option("--csv", options->csv, "file to write; one row per finished episode");
  options->mcap = app->add_option("--mcap", options->mcap_file,
                                  "for Foxglove, PlotJuggler and Rerun: a file to write, of one episode; "
                                  "without a name episode.mcap beside each episode's log")
                      ->expected(0, 1)
                      ->excludes(csv);
  app->add_option("--episode", options->episodes, "numbers of episodes, with commas; default: all")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->needs(options->mcap);
  app->add_option("--camera", options->cameras, "cameras whose pictures are drawn into it, with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->needs(options->mcap);
  app->add_option("--size", options->size, "of these pictures, WIDTHxHEIGHT in pixels")
      ->capture_default_str()
      ->needs(options->mcap);
}

int ExportCsv(const ExportOptions& options) {
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

int ExportMcap(const ExportOptions& options) {
  const std::vector<fs::path> logs = results::EpisodeLogs(options.run, options.episodes);
  if (!options.mcap_file.empty() && logs.size() != 1) {
    throw InputError(
        fmt::format("--mcap {}: a file holds one episode, and these are {}: choose one with "
                    "--episode, or leave the name away for a file beside each log",
                    options.mcap_file.string(), logs.size()));
  }
  for (const fs::path& log : logs) {
    tools::EncodedEpisode episode = tools::EncodeEpisode(log);
    if (!options.cameras.empty()) tools::AddPictures(log, options.cameras, options.size, &episode);
    const fs::path file = options.mcap_file.empty() ? log.parent_path() / "episode.mcap" : options.mcap_file;
    const std::string bytes = tools::McapFile(episode);
    WriteWhole(file, bytes);
    fmt::print("{} messages, {:.1f} MB  {}\n", episode.messages.size(),
               static_cast<double>(bytes.size()) * 1e-6, fs::proximate(file).string());
    std::fflush(stdout);
    for (const std::string& remark : episode.remarks) fmt::print(stderr, "warning: {}\n", remark);
  }
  return 0;
}

// Returns the exit code. Throws InputError, EnvironmentError.
int Export(const ExportOptions& options) {
  if (options.mcap->count() > 0) return ExportMcap(options);
  if (options.csv.empty()) throw InputError("--csv FILE or --mcap [FILE] is needed");
  return ExportCsv(options);
}

}  // namespace

Action AddExport(CLI::App* app) {
  const auto options = std::make_shared<ExportOptions>();
  AddOptions(app, options.get());
  return [options] { return Export(*options); };
}

}  // namespace evalbus::commands
