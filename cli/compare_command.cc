#include "cli/compare_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>

#include "bus/errors.h"
#include "cli/compare.h"
#include "cli/compare_text.h"
#include "cli/comparison_report.h"
#include "cli/run_reader.h"
#include "cli/version.h"
#include "metrics/json_file.h"
#include "models/scene.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// The hash of the physics model, by which runs are comparable; it stands beside run.json.
void AddModelHash(RecordedRuns* runs) {
  for (RecordedRun& run : runs->runs) {
    run.info["physics_sha256"] = Sha256File(run.folder / "model" / "physics.mjb");
  }
}

RecordedRuns Read(const fs::path& folder) {
  RecordedRuns runs = ReadRuns(folder);
  AddModelHash(&runs);
  return runs;
}

// Takes the baseline out of the runs; reads it if it is none of them.
RecordedRuns TakeBaseline(const std::string& name, std::vector<RecordedRuns>* runs) {
  const auto matches = [&](const RecordedRuns& run) {
    return name.empty() || run.name == name || run.runs[0].policy == name ||
           (fs::exists(name) && fs::equivalent(run.folder, name));
  };
  const auto found = std::find_if(runs->begin(), runs->end(), matches);
  if (found != runs->end()) {
    if (!name.empty() && std::find_if(found + 1, runs->end(), matches) != runs->end()) {
      throw InputError("--baseline " + name + ": more than one of the runs is meant; name a folder");
    }
    RecordedRuns baseline = std::move(*found);
    runs->erase(found);
    return baseline;
  }
  if (fs::is_directory(name)) return Read(name);
  std::string known;
  for (const RecordedRuns& run : *runs) known += fmt::format(", {} ({})", run.name, run.runs[0].policy);
  throw InputError("--baseline " + name + ": none of the runs and no folder; there are " + known.substr(2));
}

// Two runs of one name are told apart by their folders.
void NameApart(std::vector<RecordedRuns>* runs) {
  std::vector<std::string> names;
  for (const RecordedRuns& run : *runs) names.push_back(run.name);
  for (RecordedRuns& run : *runs) {
    if (std::count(names.begin(), names.end(), run.name) > 1)
      run.name = run.folder.lexically_normal().string();
  }
}

}  // namespace

void AddCompareOptions(CLI::App* app, CompareOptions* options) {
  app->add_option("runs", options->runs, "folders of runs or suites, two or more")->required();
  app->add_option("--baseline", options->baseline,
                  "name, policy or folder of the run that the others are compared with, also in effort;\n"
                  "default: the first");
  app->add_option("--json", options->json, "write the comparison to this file, too");
  app->add_option("--report", options->report, "write the comparison as one HTML page to this file, too");
}

int Compare(const CompareOptions& options) {
  std::vector<RecordedRuns> runs;
  for (const fs::path& folder : options.runs) runs.push_back(Read(folder));
  NameApart(&runs);
  const RecordedRuns baseline = TakeBaseline(options.baseline, &runs);
  if (runs.empty()) throw InputError("compare needs two runs, there is only " + baseline.folder.string());
  const std::vector<Comparison> comparisons = CompareAll(runs, baseline);
  for (size_t i = 0; i < comparisons.size(); ++i) {
    fmt::print("{}{}", i == 0 ? "" : "\n\n", ComparisonText(comparisons[i], !options.baseline.empty()));
  }
  if (!options.json.empty()) {
    std::ofstream stream(options.json);
    stream << ToText(ComparisonJson(comparisons), 2) << "\n";
    stream.close();
    if (!stream) throw InputError("--json " + options.json.string() + ": cannot write this file");
    fmt::print("\njson     {}\n", options.json.string());
  }
  if (!options.report.empty()) {
    std::ofstream stream(options.report);
    stream << ComparisonReport(comparisons, fmt::format("{} ({})", kVersion, kGitCommit));
    stream.close();
    if (!stream) throw InputError("--report " + options.report.string() + ": cannot write this file");
    fmt::print("\nreport   {}\n", options.report.string());
  }
  return 0;
}

}  // namespace evalbus
