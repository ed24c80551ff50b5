// evalbus-sim: the simulated world of a run. With --source as its first argument, the adapter for an external
// simulator or a robot.
#include <string_view>

#include "base/arguments.h"
#include "bus/host.h"
#include "sim/sim_component.h"
#include "sim/source_component.h"

int main(int argc, char** argv) {
  evalbus::sim::SimOptions options;
  if (argc > 1 && std::string_view(argv[1]) == "--source") {
    return evalbus::HostMain(
        argc - 1, argv + 1, "Computes STATE from the measurements of a source. Started by 'evalbus watch'.",
        [&](CLI::App* app) {
          evalbus::AddOptions(app, &options);
          app->add_option("--out", options.out, "run folder; the models are written to OUT/model");
        },
        [&](evalbus::Bus* bus) { return std::make_unique<evalbus::sim::SourceComponent>(bus, options); });
  }
  return evalbus::HostMain(
      argc, argv,
      "Simulates a task's world with MuJoCo and runs its episodes over the bus. Begins an episode on COMMAND "
      "(which\n"
      "'evalbus run' sends), or with --episodes by itself as soon as collision, metrics and policy are "
      "ready.",
      [&](CLI::App* app) {
        evalbus::AddOptions(app, &options);
        app->add_option("task", options.task,
                        "TASK[/VARIATION] or RoboEval's name: lift_pot/position, LiftPotPosition");
        app->add_option("--out", options.out, "run folder; the models are written to OUT/model");
        app->add_option("--episodes", options.episodes, "run this many episodes without waiting for COMMAND")
            ->check(CLI::NonNegativeNumber);
        app->add_option("--seed", options.seed,
                        "seed of the run; episode seeds derive from it and the episode's index")
            ->check(evalbus::FitsInt64())
            ->capture_default_str();
        evalbus::AddList(app, "--require", &options.required,
                         "components that must be ready before an episode starts")
            ->capture_default_str();
      },
      [&](evalbus::Bus* bus) {
        if (options.out.empty())
          throw evalbus::InputError("--out is missing: expected the folder of the run");
        if (options.task.empty()) throw evalbus::InputError("the task is missing: expected TASK[/VARIATION]");
        return std::make_unique<evalbus::sim::SimComponent>(bus, options);
      });
}
