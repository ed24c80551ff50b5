// evalbus run: evaluates a policy on a task.
#include "cli/launch/run.h"

#include <memory>

#include "base/arguments.h"
#include "bus/host.h"
#include "cli/commands/commands.h"

namespace evalbus::commands {

Action AddRun(CLI::App* app) {
  const auto options = std::make_shared<launch::RunOptions>();
  app->add_option(
      "task", options->tasks,
      "TASK[/VARIATION] or RoboEval's name: lift_pot/position, LiftPotPosition; several, TASK/all or all\n"
      "make a suite: a folder of runs with one summary. Without VARIATION: the task's first one, which in\n"
      "all of ours is base, where nothing is random: of a policy like expert all episodes are equal");
  AddOptions(app, options.get());
  // For those whom a run starts: a run that a person starts has a folder of its own.
  app->get_option("--options")->group("");
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-POLICY-DATE-TIME")
      ->type_name("FOLDER");
  app->add_flag("--resume", options->resume, "go on with the interrupted run in --out");
  app->add_flag("--web", options->web, "show it in a browser ('evalbus web'); the page stays until Ctrl-C");
  AddLogLevel(app);
  // For the workers themselves.
  app->add_option("--worker", options->worker)->check(CLI::NonNegativeNumber)->group("");
  return [options, app] {
    if (options->worker >= 0) {
      launch::RunWorker(*options);
    } else {
      launch::FollowContract(app->count("--control-hz") > 0, app->count("--policy-timeout-s") > 0,
                             options.get());
      if (options->tasks.empty()) throw InputError("run: expected a task ('evalbus tasks list' has them)");
      launch::Run(*options);
    }
    return 0;
  };
}

}  // namespace evalbus::commands
