// Implements `evalbus collect`, which records successful demonstrations of a task.
#include "runner/collect.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/help.h"
#include "bus/host.h"
#include "cli/commands/commands.h"

namespace evalbus::commands {
namespace {

struct CollectOptions {
  runner::RunOptions run;
  std::optional<double> noise;
};

}  // namespace

Action AddCollect(CLI::App* app) {
  const auto options = std::make_shared<CollectOptions>();
  runner::RunOptions& run = options->run;
  app->add_option("task", run.tasks, "TASK[/VARIATION]")->required()->expected(1);
  app->add_option("--out", run.out, "run folder to write")->type_name("FOLDER")->required();
  app->add_option("--episodes", run.episodes, "number of successes to record")
      ->check(CLI::Range(1, 100'000))
      ->required();
  app->add_option("--policy", run.policy.policy, "policy, in the form of --policy of 'evalbus run'")
      ->capture_default_str();
  app->add_option("--contract", run.policy.contract,
                  "contract of the server at --policy ws://...: a file, or one of 'evalbus policy list'");
  app->add_option("--policy-name", run.policy_name, "name of the policy in results; default: --policy");
  app->add_option(
         "--noise", options->noise,
         "maximum smooth deviation added to each joint of the expert, rad, for example 0.03; default: none")
      ->check(InRange(0.0, 1.0));
  app->add_option("--seed", run.seed, "seed; equal seeds give bit-identical results")
      ->check(FitsInt64())
      ->capture_default_str();
  app->add_option("--control-hz,--hz", run.sim.control_hz, "control ticks per simulated second, 5 to 500")
      ->capture_default_str();
  app->add_option(
      "--robot", run.sim.robot,
      "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)");
  app->add_option("--workers", run.workers,
                  "number of episodes to run in parallel; does not change the results")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app->add_flag("--in-process", run.in_process,
                "run all components in one process, without network; fastest");
  app->add_flag("--resume", run.resume, "continue the interrupted collection in --out");
  AddLogLevel(app);
  GroupOptions(app, {{"Policy", {"--policy", "--contract", "--policy-name", "--noise"}},
                     {"Episodes", {"--episodes", "--seed", "--workers", "--resume"}},
                     {"Simulation", {"--control-hz", "--robot", "--in-process"}},
                     {"Output", {"--out", "--log-level"}}});
  return [options, app] {
    runner::RunOptions& wanted = options->run;
    if (options->noise) {
      // "expert" or "expert:TASK" becomes "noisy_expert:RAD" or "noisy_expert:RAD:TASK".
      const std::string policy = wanted.policy.policy, name = "expert";
      if (policy != name && !policy.starts_with(name + ":"))
        throw InputError("--noise requires --policy expert or expert:TASK");
      if (*options->noise > 0)
        wanted.policy.policy = fmt::format("noisy_expert:{}{}", *options->noise, policy.substr(name.size()));
    }
    runner::FollowContract(app->count("--control-hz") > 0, false, &wanted);
    runner::Collect(wanted);
    return 0;
  };
}

}  // namespace evalbus::commands
