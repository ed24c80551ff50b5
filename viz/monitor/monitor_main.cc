// evalbus-monitor: `evalbus monitor` as a program of its own.
#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/errors.h"
#include "viz/monitor/monitor.h"

int main(int argc, char** argv) {
  CLI::App app{"Shows a run or a replay while it goes on, from its messages. Only listens."};
  evalbus::MonitorOptions options;
  evalbus::AddMonitorOptions(&app, &options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << error.what() << " (--help lists the options)\n";
    return 1;
  }
  try {
    return evalbus::Monitor(options);
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
