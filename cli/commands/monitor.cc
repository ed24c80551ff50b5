// Implements `evalbus monitor`, which shows an active run or replay in the terminal.
#include "viz/terminal/monitor.h"

#include <memory>

#include "cli/commands/commands.h"

namespace evalbus::commands {

Action AddMonitor(CLI::App* app) {
  const auto address = std::make_shared<Address>();
  AddAddressOptions(app, address.get());
  return [address] { return viz::Monitor(*address); };
}

}  // namespace evalbus::commands
