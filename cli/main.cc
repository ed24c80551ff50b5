// evalbus: the command that users type.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>

#include "bus/errors.h"
#include "cli/compare_command.h"
#include "cli/doctor.h"
#include "cli/export_command.h"
#include "cli/render_command.h"
#include "cli/replay_command.h"
#include "cli/report_command.h"
#include "cli/rescore_command.h"
#include "cli/run_command.h"
#include "cli/tasks_command.h"
#include "cli/version.h"
#include "metrics/score_file.h"
#include "viz/monitor/monitor.h"

int main(int argc, char** argv) {
  CLI::App app{"evalbus scores robot-manipulation rollouts while they run, over an LCM message bus.",
               "evalbus"};
  app.set_version_flag("--version", std::string("evalbus ") + evalbus::kVersion + " " + evalbus::kGitCommit);
  app.require_subcommand(1);

  evalbus::RunOptions run_options;
  CLI::App* run = app.add_subcommand("run", "evaluate a policy on a task, with live scores");
  evalbus::AddRunOptions(run, &run_options);

  evalbus::RenderOptions render_options;
  CLI::App* render = app.add_subcommand("render", "film episodes of a run, from their logs");
  evalbus::AddRenderOptions(render, &render_options);

  evalbus::ReplayOptions replay_options;
  CLI::App* replay = app.add_subcommand(
      "replay", "play recorded episodes into fresh metrics; compare with what was recorded");
  evalbus::AddReplayOptions(replay, &replay_options);

  evalbus::RescoreOptions rescore_options;
  CLI::App* rescore =
      app.add_subcommand("rescore", "score recorded episodes again, offline; compare with what was recorded");
  evalbus::AddRescoreOptions(rescore, &rescore_options);

  evalbus::CompareOptions compare_options;
  CLI::App* compare = app.add_subcommand("compare", "say whether runs, or suites, really differ");
  evalbus::AddCompareOptions(compare, &compare_options);

  evalbus::ExportOptions export_options;
  CLI::App* export_run =
      app.add_subcommand("export", "write the episodes of a run, or of a suite, as a table");
  evalbus::AddExportOptions(export_run, &export_options);

  evalbus::ReportOptions report_options;
  CLI::App* report = app.add_subcommand("report", "write a run, or a suite of runs, as one HTML page");
  evalbus::AddReportOptions(report, &report_options);

  evalbus::TasksOptions tasks_options;
  CLI::App* tasks = app.add_subcommand("tasks", "what there is to run; check a task file");
  evalbus::AddTasksOptions(tasks, &tasks_options);

  evalbus::Address monitor_address;
  CLI::App* monitor = app.add_subcommand("monitor", "watch a run or a replay while it goes on");
  evalbus::AddAddressOptions(monitor, &monitor_address);

  std::string score_file;
  evalbus::ScoreOptions score_options;
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
    if (*run) return evalbus::Run(run_options);
    if (*render) return evalbus::Render(render_options);
    if (*replay) return evalbus::Replay(replay_options);
    if (*rescore) return evalbus::Rescore(rescore_options);
    if (*compare) return evalbus::Compare(compare_options);
    if (*export_run) return evalbus::Export(export_options);
    if (*report) return evalbus::WriteReport(report_options);
    if (*tasks) return evalbus::Tasks(tasks_options);
    if (*monitor) return evalbus::Monitor(monitor_address);
    if (*doctor) return evalbus::Doctor();
    if (*score) {
      std::cout << evalbus::ScoreEpisode(evalbus::ReadJsonFile(score_file), score_file, score_options).dump(2)
                << "\n";
    }
    return 0;
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
