// Implements `evalbus bridge`, which streams a run to third-party viewers.

#include "cli/commands/commands.h"

namespace evalbus::commands {

Action AddBridge(CLI::App* app) {
  app->require_subcommand(1);
  CLI::App* foxglove =
      app->add_subcommand("foxglove", "serve an active run, or play a recorded episode, to Foxglove");
  CLI::App* plotjuggler =
      app->add_subcommand("plotjuggler", "send the numbers of an active run to PlotJuggler");
  const Action serve = AddFoxgloveBridge(foxglove), send = AddPlotjugglerBridge(plotjuggler);
  return [foxglove, serve, send] { return foxglove->parsed() ? serve() : send(); };
}

}  // namespace evalbus::commands
