// Implements `evalbus report`, which writes an HTML page about a run, a suite or a plan.

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/output_files.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "plans/plan_folder.h"
#include "plans/plan_report.h"
#include "report/comparison_tables.h"
#include "report/run_report.h"
#include "report/viewer_pack.h"
#include "results/run_reader.h"
#include "runner/run_json.h"
#include "runner/version.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  // Folder of a run, a suite or a plan.
  std::filesystem::path run;
  // HTML file to write; empty: report.html in that folder.
  std::filesystem::path out;
  // Episodes whose curves are drawn and which can be played in 3D. If empty, the page has curves of the first
  // failures and of one or two successes, and as many episodes in 3D as fit.
  std::vector<int> episodes;
  // Maximum size of the page with its viewer; 0: no viewer.
  double megabytes = report::kPageMegabytes;
  // Files for the success rates of a plan; may be empty.
  std::filesystem::path markdown, latex;
};

void AddOptions(CLI::App* app, ReportOptions* options) {
  app->add_option("run", options->run, "folder of a run, a suite or a plan")->required();
  app->add_option("-o,--out", options->out,
                  "HTML file; default: report.html in that folder; not for plans, whose pages are always in "
                  "their folder")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  AddList(app, "--episode", &options->episodes,
          "episodes of a run to show with curves and in 3D: numbers separated by commas; default: the first "
          "failures and the success with the median time; in 3D as many as fit");
  app->add_option(
         "--mb", options->megabytes,
         "maximum size of the page in megabytes; as many episodes as fit can be played in 3D; 0: no 3D, no "
         "images")
      ->check(InRange(0.0, 2000.0))
      ->capture_default_str();
  app->add_option(
         "--markdown", options->markdown,
         "write the success rates of a plan to this file, by task and policy, as Markdown; its pages "
         "are not written again")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  app->add_option(
         "--latex", options->latex,
         "write the success rates of a plan to this file, as a LaTeX tabular (package booktabs); its pages "
         "are not written again")
      ->type_name("FILE")
      ->check(CheckOutputFile);
}

// Prints the page's path, remarks on logs that are damaged or missing and, if the page of a run or suite has
// a note (BuiltPage::note), the note and the page's size. Returns the exit code. Throws InputError or
// EnvironmentError.
int WriteReport(const ReportOptions& options) {
  if (fs::exists(options.run / kPlanJson)) {
    if (!options.out.empty() || !options.episodes.empty() || options.megabytes != report::kPageMegabytes) {
      throw InputError(options.run.string() +
                       ": a plan, whose page is always its report.html; -o and --mb require a run or "
                       "suite, --episode a run");
    }
    CheckFilesDiffer({{"the plan's page", options.run / plans::kReportHtml},
                      {"--markdown", options.markdown},
                      {"--latex", options.latex}});
    const plans::PlanFolder folder(options.run);
    const plans::PlanResults results = plans::ReadPlanResults(folder);
    // The pages may be in manifest.json, so a command that writes a table elsewhere does not change them.
    if (options.markdown.empty() && options.latex.empty()) {
      plans::WritePlanPages(folder, results);
      fmt::print("{}\n", fs::proximate(options.run / "report.html").string());
    }
    const std::string what = "Successes of the complete episodes, with Wilson's 95 % interval of each rate.";
    const report::TextTable table = plans::RateTable(results);
    if (!options.markdown.empty())
      WriteWhole(options.markdown, report::MarkdownTable(table) + "\n" + what + "\n");
    if (!options.latex.empty()) WriteWhole(options.latex, "% " + what + "\n" + report::LatexTable(table));
    for (const fs::path& file : {options.markdown, options.latex}) {
      if (!file.empty()) fmt::print("{}\n", file.string());
    }
    return 0;
  }
  if (!options.markdown.empty() || !options.latex.empty()) {
    throw InputError("--markdown and --latex require a plan; for runs and suites, use 'evalbus compare'");
  }
  results::RecordedRuns runs = results::ReadRuns(options.run);
  if (runs.is_suite && !options.episodes.empty()) {
    throw InputError("--episode: " + options.run.string() + " is a suite; pass one of its runs");
  }
  // An episode that is given twice is shown once.
  const std::set<int> episodes(options.episodes.begin(), options.episodes.end());
  const fs::path out = options.out.empty() ? options.run / "report.html" : options.out;
  const std::string made_by =
      fmt::format("{} ({}{})", kVersion, kGitCommit, kGitDirty ? ", with changes" : "");
  const report::BuiltPage page =
      report::RunReport(std::move(runs), out, {episodes.begin(), episodes.end()}, made_by,
                        static_cast<size_t>(options.megabytes * 1e6), runner::CommandOf);
  WriteWhole(out, page.html);
  fmt::print("{}\n", fs::proximate(out).string());
  for (const std::string& remark : page.remarks) fmt::print("note: {}\n", remark);
  if (!page.note.empty()) {
    fmt::print("{} The page has {:.1f} MB.\n", page.note, static_cast<double>(page.html.size()) / 1e6);
  }
  return 0;
}

}  // namespace

Action AddReport(CLI::App* app) { return ActionOf<ReportOptions>(app, AddOptions, WriteReport); }

}  // namespace evalbus::commands
