// evalbus-monitor: `evalbus monitor` as a separate program.
#include <CLI/CLI.hpp>

#include "base/arguments.h"
#include "base/errors.h"
#include "viz/terminal/monitor.h"

int main(int argc, char** argv) {
  CLI::App app{"Shows an active run or replay from its messages. Publishes nothing."};
  evalbus::Address address;
  evalbus::AddAddressOptions(&app, &address);
  if (const auto code = evalbus::ParseArguments(&app, argc, argv)) return *code;
  try {
    return evalbus::viz::Monitor(address);
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
