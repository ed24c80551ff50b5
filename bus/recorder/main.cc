// evalbus-recorder: writes the logs of a run.
#include "base/arguments.h"
#include "bus/host.h"
#include "bus/recorder/recorder.h"
#include "bus/recorder/recorder_options.h"

int main(int argc, char** argv) {
  evalbus::RecorderOptions options;
  return evalbus::HostMain(
      argc, argv,
      "Writes all messages on the bus into one standard LCM event log per episode: "
      "OUT/episodes/0000/events.lcmlog.\n"
      "Works with any publisher of evalbus messages; lcm-logplayer can play its logs.",
      [&](CLI::App* app) {
        evalbus::AddOptions(app, &options);
        app->add_option("--out", options.out, "run folder; created if it does not exist");
      },
      [&](evalbus::Bus* bus) {
        if (options.out.empty())
          throw evalbus::InputError("--out is missing: expected the folder of the run");
        return std::make_unique<evalbus::Recorder>(bus, options.out, evalbus::ParseLogForm(options.log));
      });
}
