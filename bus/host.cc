#include "bus/host.h"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/exit_guard.h"
#include "base/realtime.h"
#include "bus/private_network.h"

namespace evalbus {
namespace {

constexpr auto kPollPeriod = std::chrono::milliseconds(100);

volatile std::sig_atomic_t g_stop = 0;

}  // namespace

void InstallStopSignals() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };  // no SA_RESTART, so that a signal interrupts waits
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool stop_requested() { return g_stop != 0; }

int Host(const std::string& url, const ComponentFactory& make, int64_t session, int64_t instance) {
  InstallStopSignals();
  const ExitGuard exit_guard;
  std::unique_ptr<Bus> bus;
  std::unique_ptr<Component> component;
  const auto fail = [&component](const std::exception& error) {
    try {
      if (component) component->Fail(error.what());
    } catch (const std::exception&) {
      // If the bus itself failed, STATUS cannot be published. The exit code reports the failure.
    }
    const int code = ReportError(error);
    return dynamic_cast<const LastingError*>(&error) ? kLastingFailureCode : code;
  };
  try {
    bus = std::make_unique<Bus>(url, session, instance);
    component = make(bus.get());
    std::cout << component->status().component << " ready" << std::endl;
    while (!stop_requested() && !component->done()) {
      const auto now = std::chrono::steady_clock::now();
      component->Poll(now);
      bus->Handle(std::min(component->next_poll(), now + kPollPeriod));
    }
    component->Stop();
    return 0;
  } catch (const std::exception& error) {
    return fail(error);
  } catch (...) {
    return fail(EnvironmentError(kNotAnException));
  }
}

void AddLogLevel(CLI::App* app) {
  app->add_option_function<std::string>(
      "--log-level",
      [](const std::string& word) {
        Log::SetLevel(ParseLogLevel(word));
        setenv("EVALBUS_LOG_LEVEL", word.c_str(), 1);
      },
      "log level: debug, info, warn, error or off; default: EVALBUS_LOG_LEVEL or info");
}

int HostMain(int argc, char** argv, const std::string& description,
             const std::function<void(CLI::App*)>& add_options, const ComponentFactory& make) {
  CLI::App app{description};
  std::string url;
  int64_t session = 0, instance = 0;
  int realtime_priority = 0;
  add_options(&app);
  // A launcher passes --options to every component. A component without specific options accepts it and
  // ignores the file's contents.
  if (app.get_option_no_throw("--options") == nullptr) AddOptionsFile(&app, [](const std::string&) {});
  app.add_option("--url", url,
                 "bus of the run, udpm://ADDRESS:PORT?ttl=0; all processes of a run use the same one")
      ->envname(kUrlVariable)
      ->required();
  // These options are hidden, because only launchers set them.
  app.add_option("--session", session)->group("");
  app.add_option("--instance", instance)->group("");
  app.add_option("--realtime-priority", realtime_priority)->group("");
  AddLogLevel(&app);
  if (const auto code = ParseArguments(&app, argc, argv)) return *code;
  if (realtime_priority > 0) RequestRealtime(realtime_priority);
  return Host(url, make, session, instance);
}

}  // namespace evalbus
