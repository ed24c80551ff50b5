// evalbus: the command that users type.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>

#include "base/errors.h"
#include "cli/commands/compare.h"
#include "cli/commands/doctor.h"
#include "cli/commands/export.h"
#include "cli/commands/render.h"
#include "cli/commands/replay.h"
#include "cli/commands/report.h"
#include "cli/commands/rescore.h"
#include "cli/commands/run.h"
#include "cli/commands/tasks.h"
#include "cli/version.h"
#include "metrics/episode/score_file.h"
#include "viz/terminal/monitor.h"

int main(int argc, char** argv) {
  CLI::App app{"evalbus scores robot-manipulation rollouts while they run, over an LCM message bus.",
               "evalbus"};
  app.set_version_flag("--version", std::string("evalbus ") + evalbus::kVersion + " " + evalbus::kGitCommit);
  app.require_subcommand(1);

  evalbus::launch::RunOptions run_options;
  CLI::App* run = app.add_subcommand("run", "evaluate a policy on a task, with live scores");
  evalbus::commands::AddRunOptions(run, &run_options);

  evalbus::commands::RenderOptions render_options;
  CLI::App* render = app.add_subcommand("render", "film episodes of a run, from their logs");
  evalbus::commands::AddRenderOptions(render, &render_options);

  evalbus::commands::ReplayOptions replay_options;
  CLI::App* replay = app.add_subcommand(
      "replay", "play recorded episodes into fresh metrics; compare with what was recorded");
  evalbus::commands::AddReplayOptions(replay, &replay_options);

  evalbus::commands::RescoreOptions rescore_options;
  CLI::App* rescore =
      app.add_subcommand("rescore", "score recorded episodes again, offline; compare with what was recorded");
  evalbus::commands::AddRescoreOptions(rescore, &rescore_options);

  evalbus::commands::CompareOptions compare_options;
  CLI::App* compare = app.add_subcommand("compare", "say whether runs, or suites, really differ");
  evalbus::commands::AddCompareOptions(compare, &compare_options);

  evalbus::commands::ExportOptions export_options;
  CLI::App* export_run =
      app.add_subcommand("export", "write the episodes of a run, or of a suite, as a table");
  evalbus::commands::AddExportOptions(export_run, &export_options);

  evalbus::commands::ReportOptions report_options;
  CLI::App* report = app.add_subcommand("report", "write a run, or a suite of runs, as one HTML page");
  evalbus::commands::AddReportOptions(report, &report_options);

  evalbus::commands::TasksOptions tasks_options;
  CLI::App* tasks = app.add_subcommand("tasks", "what there is to run; check a task file");
  evalbus::commands::AddTasksOptions(tasks, &tasks_options);

  evalbus::Address monitor_address;
  CLI::App* monitor = app.add_subcommand("monitor", "watch a run or a replay while it goes on");
  evalbus::AddAddressOptions(monitor, &monitor_address);

  std::string score_file;
  evalbus::metrics::ScoreOptions score_options;
  CLI::App* score =
      app.add_subcommand("score", "score one recorded trajectory (JSON), print the result dictionary");
  score->add_option("file", score_file, "trajectory in the format of docs/metrics.md")->required();
  score
      ->add_option("--collision-sample-window", score_options.collision_sample_window,
                   "look at contacts every this many steps; 0 = the file's slip_sample_window")
      ->capture_default_str();

  CLI::App* doctor = app.add_subcommand("doctor", "check what this machine offers and how to mend it");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    // CLI11 misses the command before it minds what stands in its place.
    const bool unknown = app.get_subcommands().empty() && !app.remaining().empty();
    std::cerr << "error: " << (unknown ? "there is no command '" + app.remaining()[0] + "'" : error.what())
              << " ('evalbus --help' lists the commands)\n";
    return 1;
  }
  try {
    if (*run) return evalbus::commands::Run(run_options);
    if (*render) return evalbus::commands::Render(render_options);
    if (*replay) return evalbus::commands::Replay(replay_options);
    if (*rescore) return evalbus::commands::Rescore(rescore_options);
    if (*compare) return evalbus::commands::Compare(compare_options);
    if (*export_run) return evalbus::commands::Export(export_options);
    if (*report) return evalbus::commands::WriteReport(report_options);
    if (*tasks) return evalbus::commands::Tasks(tasks_options);
    if (*monitor) return evalbus::viz::Monitor(monitor_address);
    if (*doctor) return evalbus::commands::Doctor();
    if (*score) {
      std::cout << evalbus::metrics::ScoreEpisode(evalbus::ReadJsonFile(score_file), score_file,
                                                  score_options)
                       .dump(2)
                << "\n";
    }
    return 0;
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
