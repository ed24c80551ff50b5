// evalbus compare: whether runs, or suites, really differ.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/launch/version.h"
#include "cli/results/comparison.h"
#include "cli/results/comparison_json.h"
#include "cli/results/comparison_report.h"
#include "cli/results/comparison_text.h"
#include "cli/results/run_reader.h"
#include "cli/results/viewer_pack.h"
#include "models/scene.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  std::vector<std::filesystem::path> runs;
  // Name, policy or folder of the run that the others are compared with; empty: the first.
  std::string baseline;
  // Empty: none is written.
  std::filesystem::path json;
  // HTML page; empty: none is written.
  std::filesystem::path report;
  // Of that page with its viewer; 0: none.
  double megabytes = results::kPageMegabytes;
};

// The hash of the physics model, by which runs are comparable; it stands beside run.json.
void AddModelHash(results::RecordedRuns* runs) {
  for (results::RecordedRun& run : runs->runs) {
    run.info["physics_sha256"] = Sha256File(run.folder / kModelFolder / kPhysicsModel);
  }
}

results::RecordedRuns Read(const fs::path& folder) {
  results::RecordedRuns runs = results::ReadRuns(folder);
  AddModelHash(&runs);
  return runs;
}

// Takes the baseline out of the runs; reads it if it is none of them.
results::RecordedRuns TakeBaseline(const std::string& name, std::vector<results::RecordedRuns>* runs) {
  const auto matches = [&](const results::RecordedRuns& run) {
    return name.empty() || run.name == name || run.runs[0].policy == name ||
           (fs::exists(name) && fs::equivalent(run.folder, name));
  };
  const auto found = std::find_if(runs->begin(), runs->end(), matches);
  if (found != runs->end()) {
    if (!name.empty() && std::find_if(found + 1, runs->end(), matches) != runs->end()) {
      throw InputError("--baseline " + name + ": more than one of the runs is meant; name a folder");
    }
    results::RecordedRuns baseline = std::move(*found);
    runs->erase(found);
    return baseline;
  }
  if (fs::is_directory(name)) return Read(name);
  std::string known;
  for (const results::RecordedRuns& run : *runs)
    known += fmt::format(", {} ({})", run.name, run.runs[0].policy);
  throw InputError("--baseline " + name + ": none of the runs and no folder; there are " + known.substr(2));
}

// Two runs of one name are told apart by their folders.
void NameApart(std::vector<results::RecordedRuns>* runs) {
  std::vector<std::string> names;
  for (const results::RecordedRuns& run : *runs) names.push_back(run.name);
  for (results::RecordedRuns& run : *runs) {
    if (std::count(names.begin(), names.end(), run.name) > 1)
      run.name = run.folder.lexically_normal().string();
  }
}

void AddOptions(CLI::App* app, CompareOptions* options) {
  app->add_option("runs", options->runs, "folders of runs or suites, two or more")->required();
  app->add_option("--baseline", options->baseline,
                  "name, policy or folder of the run that the others are compared with, also in effort;\n"
                  "default: the first");
  app->add_option("--json", options->json, "write the comparison to this file, too");
  app->add_option("--report", options->report, "write the comparison as one HTML page to this file, too");
  app->add_option("--mb", options->megabytes,
                  "largest size of that page in megabytes, which says how many pairs of episodes are packed\n"
                  "into it to be shown in 3D, flipped seeds first; 0: none")
      ->check(CLI::Range(0.0, 2000.0))
      ->capture_default_str();
}

// Returns the exit code: 0, whatever the verdict. Throws InputError.
int Compare(const CompareOptions& options) {
  std::vector<results::RecordedRuns> runs;
  for (const fs::path& folder : options.runs) runs.push_back(Read(folder));
  NameApart(&runs);
  const results::RecordedRuns baseline = TakeBaseline(options.baseline, &runs);
  if (runs.empty()) throw InputError("compare needs two runs, there is only " + baseline.folder.string());
  const std::vector<results::Comparison> comparisons = results::CompareAll(runs, baseline);
  for (size_t i = 0; i < comparisons.size(); ++i) {
    fmt::print("{}{}", i == 0 ? "" : "\n\n",
               results::ComparisonText(comparisons[i], !options.baseline.empty()));
  }
  if (!options.json.empty()) {
    WriteWhole(options.json, ToText(results::ComparisonJson(comparisons), 2) + "\n");
    fmt::print("\njson     {}\n", options.json.string());
  }
  if (!options.report.empty()) {
    const results::ComparisonPage page =
        results::ComparisonReport(comparisons, options.report, fmt::format("{} ({})", kVersion, kGitCommit),
                                  static_cast<size_t>(options.megabytes * 1e6));
    WriteWhole(options.report, page.html);
    fmt::print("\nreport   {}  {:.1f} MB{}\n", options.report.string(),
               static_cast<double>(page.html.size()) / 1e6, page.note.empty() ? "" : "; " + page.note);
  }
  return 0;
}

}  // namespace

Action AddCompare(CLI::App* app) {
  const auto options = std::make_shared<CompareOptions>();
  AddOptions(app, options.get());
  return [options] { return Compare(*options); };
}

}  // namespace evalbus::commands
