// evalbus-metrics: computes the scores of a run.
#include "base/arguments.h"
#include "base/plugins.h"
#include "bus/host.h"
#include "bus/live_runs.h"
#include "metrics/episode/part_of_run.h"
#include "metrics/metrics_component.h"

int main(int argc, char** argv) {
  if (const auto code = evalbus::LoadPlugins(evalbus::kPredicatePlugins)) return *code;
  bool is_part = false;
  std::string replayed;
  return evalbus::HostMain(
      argc, argv,
      "Scores rollouts: publishes partial scores at every control tick, and summaries per episode and per "
      "run.",
      [&](CLI::App* app) {
        evalbus::AddOptionsFile(app, [&](const std::string& file) {
          is_part = evalbus::metrics::IsPartOfRun(std::filesystem::path(file).parent_path());
        });
        // The value is not used. The option only marks this process as part of a replay, for tools that list
        // processes.
        app->add_option(evalbus::kReplayOption, replayed)->group("");
      },
      [&](evalbus::Bus* bus) { return std::make_unique<evalbus::metrics::MetricsComponent>(bus, is_part); });
}
