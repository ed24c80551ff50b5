// evalbus export: the episodes of a run, or of a suite, as a table for other programs.

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/results/episode_table.h"
#include "cli/results/run_reader.h"

namespace evalbus::commands {
namespace {

struct ExportOptions {
  std::filesystem::path run;
  std::filesystem::path csv;
};

void AddOptions(CLI::App* app, ExportOptions* options) {
  app->add_option("run", options->run, "folder of a run or of a suite")->required();
  app->add_option("--csv", options->csv, "file to write; one row per finished episode")->required();
}

// Returns the exit code. Throws InputError.
int Export(const ExportOptions& options) {
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

}  // namespace

Action AddExport(CLI::App* app) {
  const auto options = std::make_shared<ExportOptions>();
  AddOptions(app, options.get());
  return [options] { return Export(*options); };
}

}  // namespace evalbus::commands
