// Implements `evalbus latency`, which evaluates a policy with several inference delays.
#include "plans/latency.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/help.h"
#include "cli/commands/commands.h"
#include "viz/terminal/terminal.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

constexpr std::array kAllExecutions = {"synchronous", "asynchronous", "rtc"};

struct LatencyOptions {
  runner::RunOptions run;
  std::vector<std::string> delays = {"0", "50", "100", "150", "200", "250", "300", "400"};
  std::vector<std::string> executions = {"synchronous"};
};

void AddOptions(CLI::App* app, LatencyOptions* options) {
  runner::RunOptions& run = options->run;
  run.episodes = 100;
  app->add_option("task", run.tasks, "TASK[/VARIATION]: one task with one variation")
      ->required()
      ->expected(1);
  app->add_option("--policy", run.policy.policy, "policy, in the form of --policy of 'evalbus run'")
      ->capture_default_str();
  app->add_option("--contract", run.policy.contract,
                  "contract of the server at --policy ws://...: a file, or one of 'evalbus policy list'");
  AddList(app, "--delays", &options->delays,
          "inference delays in simulated time, ms, separated by commas; rounded up to whole ticks")
      ->capture_default_str();
  AddList(app, "--execution", &options->executions,
          "what the robot does during an inference: synchronous, asynchronous, rtc, separated by commas, or "
          "all")
      ->capture_default_str();
  app->add_option("--episodes", run.episodes, "number of episodes for each delay and execution mode")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  app->add_option("--seed", run.seed,
                  "seed of the runs; a deterministic policy has bit-identical results for equal seeds")
      ->check(FitsInt64())
      ->capture_default_str();
  app->add_option(
      "--robot", run.sim.robot,
      "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)");
  app->add_option("--control-hz,--hz", run.sim.control_hz, "control ticks per simulated second, 5 to 500")
      ->capture_default_str();
  app->add_option("--workers", run.workers, "number of runs at a time; does not change the results")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app->add_option("--out", run.out, "folder to write; default runs/latency-DATE-TIME")->type_name("FOLDER");
  app->add_flag("--resume", run.resume, "continue the interrupted command in --out");
  GroupOptions(app, {{"Policy", {"--policy", "--contract", "--delays", "--execution"}},
                     {"Episodes", {"--episodes", "--seed", "--workers", "--resume"}},
                     {"Simulation", {"--robot", "--control-hz"}},
                     {"Output", {"--out"}}});
}

int MeasureLatency(LatencyOptions options, const CLI::App& app) {
  if (std::ranges::find(options.executions, "all") != options.executions.end()) {
    options.executions.assign(kAllExecutions.begin(), kAllExecutions.end());
  }
  for (const std::string& execution : options.executions) {
    if (std::ranges::find(kAllExecutions, execution) == kAllExecutions.end()) {
      throw InputError(fmt::format("--execution: expected {}, or all, got '{}'",
                                   fmt::join(kAllExecutions, ", "), execution));
    }
  }
  const fs::path out = options.run.out;
  if (!options.run.resume && !out.empty()) plans::CheckOutIsNew(out);
  const int workers = options.run.workers;
  const plans::PlanFolder folder(
      plans::LatencyPlan(options.run, options.delays, options.executions, app.count("--control-hz") > 0),
      out);
  const auto [points, effects] = plans::RunLatencyPlan(folder, workers);
  const fs::path written = fs::proximate(folder.path());
  const auto width = static_cast<size_t>(viz::TerminalWidth(stdout));
  fmt::print("\n");
  for (const std::string& line : results::DelayHeadline(points, effects))
    fmt::print("{}\n", Wrapped(line, 0, width));
  fmt::print("\n{}\nfigure   {}\ntable    {}\njson     {}\n", results::DelayTable(points),
             (written / "latency.svg").string(), (written / "latency.csv").string(),
             (written / "latency.json").string());
  return 0;
}

}  // namespace

Action AddLatency(CLI::App* app) {
  const auto options = std::make_shared<LatencyOptions>();
  AddOptions(app, options.get());
  return [options, app] { return MeasureLatency(*options, *app); };
}

}  // namespace evalbus::commands
