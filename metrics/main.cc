// evalbus-metrics: the scores of a run.
#include "bus/host.h"
#include "metrics/metrics_component.h"

int main(int argc, char** argv) {
  return evalbus::HostMain(
      argc, argv,
      "Scores rollouts: publishes partial scores at every control tick, and summaries per episode and per "
      "run.",
      [](CLI::App*) {},
      [](evalbus::Bus* bus) { return std::make_unique<evalbus::metrics::MetricsComponent>(bus); });
}
