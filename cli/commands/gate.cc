// Implements `evalbus gate`, which decides whether a run may replace its baseline.

#include "results/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "base/arguments.h"
#include "base/output_files.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "report/gate_files.h"
#include "results/commanded_motion.h"
#include "results/comparability.h"
#include "results/compared_runs.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct GateCommandOptions {
  fs::path baseline, run;
  results::GateOptions gate;
  // Files to write; empty: not written.
  fs::path junit, markdown;
};

void AddOptions(CLI::App* app, GateCommandOptions* options) {
  app->add_option("baseline", options->baseline, "run or suite of the policy that is in use")->required();
  app->add_option("run", options->run, "new run or suite, on the same tasks and seeds")->required();
  app->add_option("--margin", options->gate.margin.value,
                  "largest acceptable loss: percentage points of success; for metrics of --on without a "
                  "margin,\npercent of the baseline's mean")
      ->check(CLI::Validator(
          [range = InRange(0.1, 99.0)](std::string& text) {
            const std::string error = range(text);
            // A value that is not a number has no unit.
            return error.find("range") == std::string::npos ? error : error + " percentage points";
          },
          InRange(0.1, 99.0).get_description()))
      ->capture_default_str();
  AddList(app, "--on", &options->gate.on,
          "metrics that must not get worse either, separated by commas: NAME, NAME:MARGIN in the metric's "
          "unit,\nor NAME:10% of the baseline's mean, for example slips:0.2,completion_time:10%; success "
          "is always tested");
  app->add_option("--junit", options->junit, "also write the decision to this file, as JUnit XML")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  app->add_option("--markdown", options->markdown,
                  "also write a summary for a pull request to this file, as Markdown")
      ->type_name("FILE")
      ->check(CheckOutputFile);
}

int ExitCode(results::GateVerdict verdict) {
  return verdict == results::GateVerdict::kPass ? 0 : verdict == results::GateVerdict::kFail ? 10 : 11;
}

// Returns 0 for PASS, 10 for FAIL, 11 for CANNOT TELL. Throws InputError or EnvironmentError.
int DecideGate(const GateCommandOptions& options) {
  CheckFilesDiffer({{"--junit", options.junit}, {"--markdown", options.markdown}});
  std::vector<results::RecordedRuns> runs = {results::ReadForComparison(options.baseline),
                                             results::ReadForComparison(options.run)};
  results::NameApart(&runs);
  results::CheckSameEngine({&runs[0], &runs[1]});
  results::GateOptions rule = options.gate;
  rule.has_commanded_motion = std::ranges::any_of(runs[1].runs, results::ShowsCommandedMotion);
  const results::Gate gate = results::Decide(runs[1], runs[0], rule);
  fmt::print("{}", results::GateText(gate));
  if (!options.junit.empty()) WriteWhole(options.junit, report::GateJunit(gate));
  if (!options.markdown.empty()) WriteWhole(options.markdown, report::GateMarkdown(gate));
  return ExitCode(gate.verdict);
}

}  // namespace

Action AddGate(CLI::App* app) { return ActionOf<GateCommandOptions>(app, AddOptions, DecideGate); }

}  // namespace evalbus::commands
