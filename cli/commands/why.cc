// evalbus why: which start parameters influence success.

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "results/circumstances.h"
#include "results/circumstances_text.h"
#include "results/found_runs.h"
#include "results/run_reader.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct WhyOptions {
  std::vector<fs::path> runs;
  // Empty: no JSON file is written.
  fs::path json;
};

// Reads the runs, suites and plans that have finished episodes.
std::vector<results::RecordedRun> ReadAll(const std::vector<fs::path>& folders) {
  std::vector<results::RecordedRun> runs;
  for (const fs::path& folder : folders) {
    const size_t before = runs.size();
    for (const results::FoundRun& found : results::FindRuns(folder).runs) {
      if (!fs::exists(found.folder / kEpisodesJsonl)) continue;
      runs.push_back(results::ReadRun(found.folder));
      runs.back().name = found.name;
    }
    if (runs.size() == before) throw InputError(folder.string() + ": no finished episode");
  }
  return runs;
}

// Returns the exit code: 0, whatever is found. Throws InputError.
int Explain(const WhyOptions& options) {
  const std::vector<results::RecordedRun> runs = ReadAll(options.runs);
  std::vector<const results::RecordedRun*> all;
  for (const results::RecordedRun& run : runs) all.push_back(&run);
  const std::vector<results::RunCircumstances> found = results::FindCircumstances(all);
  for (size_t i = 0; i < found.size(); ++i) {
    fmt::print("{}{}", i == 0 ? "" : "\n", results::CircumstancesText(found[i], UsesColors(stdout)));
  }
  if (!options.json.empty()) {
    WriteWhole(options.json, ToText(results::CircumstancesJson(found), 2) + "\n");
    fmt::print("\njson     {}\n", options.json.string());
  }
  return 0;
}

}  // namespace

Action AddWhy(CLI::App* app) {
  const auto options = std::make_shared<WhyOptions>();
  app->add_option("runs", options->runs, "folders of runs, suites or plans")->required();
  app->add_option("--json", options->json, "also write the results to this file");
  return [options] { return Explain(*options); };
}

}  // namespace evalbus::commands
