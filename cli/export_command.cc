#include "cli/export_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>

#include "bus/errors.h"
#include "cli/episode_table.h"
#include "cli/run_reader.h"

namespace evalbus {

void AddExportOptions(CLI::App* app, ExportOptions* options) {
  app->add_option("run", options->run, "folder of a run or of a suite")->required();
  app->add_option("--csv", options->csv, "file to write; one row per finished episode")->required();
}

int Export(const ExportOptions& options) {
  const RecordedRuns runs = ReadRuns(options.run);
  const std::string table = EpisodeTable(runs.runs);
  // In place as a whole or not at all.
  const std::filesystem::path temporary = options.csv.string() + ".tmp";
  std::ofstream stream(temporary, std::ios::binary);
  stream << table;
  stream.close();
  if (!stream) throw InputError("--csv " + options.csv.string() + ": cannot write this file");
  std::filesystem::rename(temporary, options.csv);
  size_t episodes = 0;
  for (const RecordedRun& run : runs.runs) episodes += run.episodes.size();
  fmt::print("{} episode{}  {}\n", episodes, episodes == 1 ? "" : "s", options.csv.string());
  for (const RecordedRun& run : runs.runs) {
    for (const std::string& remark : run.Remarks()) fmt::print("note: {}: {}\n", run.name, remark);
  }
  return 0;
}

}  // namespace evalbus
