// evalbus-recorder: writes the logs of a run.
#include <CLI/CLI.hpp>

#include "bus/recorder/recorder.h"

int main(int argc, char** argv) {
  std::string out;
  return evalbus::HostMain(
      argc, argv,
      "Writes everything on the bus into one standard LCM event log per episode: "
      "OUT/episodes/0000/events.lcmlog.\n"
      "Works with any publisher of evalbus messages; lcm-logplayer and lcm-spy read what it writes.",
      [&](CLI::App* app) {
        app->add_option("--out", out, "run folder; created if it does not exist")->required();
      },
      [&](evalbus::Bus* bus) { return std::make_unique<evalbus::Recorder>(bus, out); });
}
