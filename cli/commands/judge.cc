// Implements `evalbus judge`, which lets an operator give verdicts on recorded episodes without knowing the
// policy or the score.
#include "report/web/judge.h"

#include <fmt/format.h>

#include <memory>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/json_file.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "report/web/web.h"
#include "results/operator_results.h"
#include "results/run_reader.h"

namespace evalbus::commands {
namespace {

struct JudgeCommandOptions {
  report::JudgeOptions judge;
  // The option --seed.
  CLI::Option* seed = nullptr;
  // JSON file to write; empty: none.
  std::filesystem::path json;
};

int JudgeRuns(const JudgeCommandOptions& options) {
  if (options.judge.runs.size() > 2) {
    throw InputError(fmt::format("expected one run, or two runs of the same task, got {} runs",
                                 options.judge.runs.size()));
  }
  if (options.seed->count() > 0 && options.judge.runs.size() != 2)
    throw InputError("--seed requires two runs: the episodes of one run are shown in their own order");
  // The run of a parent process may not have begun yet.
  for (const auto& folder : options.judge.runs) {
    if (!options.judge.is_child) results::CheckRunFolder(folder);
  }
  if (!options.judge.operator_name.empty()) {
    report::Judge(options.judge);
    if (options.json.empty()) return 0;
  }
  std::vector<results::JudgedRun> runs;
  for (const auto& folder : options.judge.runs) runs.push_back(results::ReadJudgedRun(folder));
  if (options.judge.operator_name.empty()) {
    for (const std::string& line : results::JudgmentLines(runs)) fmt::print("{}\n", line);
  }
  if (!options.json.empty()) WriteWhole(options.json, ToText(results::JudgmentJson(runs), 2) + "\n");
  return 0;
}

}  // namespace

Action AddJudge(CLI::App* app) {
  const auto options = std::make_shared<JudgeCommandOptions>();
  report::JudgeOptions& judge = options->judge;
  app->add_option(
         "run", judge.runs,
         "folder of a run, finished or active; or two finished runs of one task with equal seeds, whose\n"
         "episodes are shown in random order, without the policies' names")
      ->required();
  CLI::Option* const by =
      app->add_option("--operator", judge.operator_name,
                      "name of the person who judges; without it, the results so far are printed")
          ->check(NotEmpty())
          ->type_name("NAME");
  options->seed =
      app->add_option("--seed", judge.seed, "seed of the order in which the episodes of two runs are shown")
          ->needs(by)
          ->capture_default_str();
  app->add_option("--json", options->json, "also write the results to this file, as JSON")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  app->add_option("--port", judge.port,
                  "port to listen on; 0: any free port; default: 8080, or any free port if it is in use")
      ->needs(by);
  app->add_flag(report::kWebChildOption, judge.is_child)->group("");
  return [options] { return JudgeRuns(*options); };
}

}  // namespace evalbus::commands
