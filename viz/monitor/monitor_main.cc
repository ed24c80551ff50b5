// evalbus-monitor: `evalbus monitor` as a program of its own.
#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/errors.h"
#include "viz/monitor/monitor.h"

int main(int argc, char** argv) {
  CLI::App app{"Shows a run or a replay while it goes on, from its messages. Only listens."};
  evalbus::Address address;
  evalbus::AddAddressOptions(&app, &address);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << error.what() << " (--help lists the options)\n";
    return 1;
  }
  try {
    return evalbus::Monitor(address);
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
