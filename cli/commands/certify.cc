// Implements `evalbus certify`, which tests whether verdicts depend on the version of MuJoCo.
#include "plans/certify.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/help.h"
#include "cli/commands/commands.h"
#include "plans/plan_folder.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct CertifyOptions {
  runner::RunOptions run;
  std::vector<std::string> engines;
  std::vector<std::string> policies = {"expert", "noisy_expert"};
};

void AddOptions(CLI::App* app, CertifyOptions* options) {
  runner::RunOptions& run = options->run;
  run.episodes = 50;
  app->add_option("task", run.tasks,
                  "TASK/VARIATION or several, as for 'evalbus run'; or a plan's YAML file, which then names "
                  "policies,\nepisodes, seed and options (docs/plans.md)")
      ->required();
  AddList(app, "--engines", &options->engines,
          "versions of MuJoCo, separated by commas, for example 2.2,3.3.3; the others are compared with the "
          "first")
      ->required();
  AddList(app, "--policies", &options->policies, "policies, separated by commas")->capture_default_str();
  app->add_option("--episodes", run.episodes, "number of episodes of each policy, task and engine")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  app->add_option("--seed", run.seed,
                  "seed of the runs; a deterministic policy has bit-identical results for equal seeds")
      ->check(FitsInt64())
      ->capture_default_str();
  app->add_option(
      "--robot", run.sim.robot,
      "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)");
  app->add_option("--model-path", run.sim.model_path,
                  "folder to search for a robot's MJCF files, e.g. a MuJoCo Menagerie; can be repeated")
      ->allow_extra_args(false);
  AddList(app, "--assets", &run.sim.assets,
          "NAME=FOLDER: files of a task that are not part of evalbus, e.g. roboeval=CHECKOUT");
  app->add_option("--control-hz,--hz", run.sim.control_hz, "control ticks per simulated second, 5 to 500")
      ->capture_default_str();
  app->add_option("--workers", run.workers, "number of runs at a time; does not change the results")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app->add_option("--out", run.out, "folder to write: runs by engine and policy, and certificate.json")
      ->type_name("FOLDER")
      ->required();
  app->add_flag("--resume", run.resume, "continue the interrupted command in --out, or add an engine");
  GroupOptions(app, {{"Policy", {"--policies"}},
                     {"Episodes", {"--episodes", "--seed", "--workers", "--resume"}},
                     {"Simulation", {"--engines", "--robot", "--model-path", "--assets", "--control-hz"}},
                     {"Output", {"--out"}}});
}

plans::Plan PlanOf(const CertifyOptions& options, const CLI::App& app) {
  const std::vector<std::string>& tasks = options.run.tasks;
  if (tasks.size() != 1 || !plans::IsPlanFile(tasks[0])) {
    return plans::MakePlan("certify", options.policies, options.run, app.count("--control-hz") > 0);
  }
  for (const char* name :
       {"--policies", "--episodes", "--seed", "--robot", "--model-path", "--assets", "--control-hz"}) {
    if (app.count(name) > 0) throw InputError(fmt::format("{}: {} determines this option", name, tasks[0]));
  }
  plans::Plan plan = plans::ReadPlan(tasks[0]);
  if (plan.until) {
    throw InputError(tasks[0] +
                     ": until: remove this key: 'evalbus certify' runs a fixed number of episodes");
  }
  return plan;
}

int Certify(const CertifyOptions& options, const CLI::App& app) {
  const fs::path& out = options.run.out;
  if (!options.run.resume) plans::CheckOutIsNew(out);
  const std::vector<std::string> engines = plans::FindEngines(options.engines);
  const plans::Certified certified =
      plans::CertifyPlan(PlanOf(options, app), engines, out, options.run.workers);
  fmt::print("{}\njson     {}\n", results::CertificateText(certified.certificate, certified.stages),
             (out / plans::kCertificateJson).string());
  return 0;
}

}  // namespace

Action AddCertify(CLI::App* app) {
  const auto options = std::make_shared<CertifyOptions>();
  AddOptions(app, options.get());
  return [options, app] { return Certify(*options, *app); };
}

}  // namespace evalbus::commands
