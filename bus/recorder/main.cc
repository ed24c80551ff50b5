// evalbus-recorder: writes the logs of a run.
#include "base/arguments.h"
#include "bus/host.h"
#include "bus/recorder/recorder.h"

int main(int argc, char** argv) {
  std::filesystem::path out;
  return evalbus::HostMain(
      argc, argv,
      "Writes everything on the bus into one standard LCM event log per episode: "
      "OUT/episodes/0000/events.lcmlog.\n"
      "Works with any publisher of evalbus messages; lcm-logplayer reads what it writes.",
      [&](CLI::App* app) {
        evalbus::AddOptionsFile(
            app, [&](const std::string& file) { out = std::filesystem::path(file).parent_path(); });
        app->add_option("--out", out, "run folder; created if it does not exist");
      },
      [&](evalbus::Bus* bus) {
        if (out.empty()) throw evalbus::InputError("--out: expected the folder of the run, it is missing");
        return std::make_unique<evalbus::Recorder>(bus, out);
      });
}
