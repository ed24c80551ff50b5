// What every process of a run has in common: a component works in its message handlers, reports its health on
// STATUS, and is hosted either alone in a process (HostMain) or with the others on one in-process bus.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/header_t.hpp"

namespace CLI {
class App;
}

namespace evalbus {

class Component {
 public:
  // lag_window_ticks: see component_status_t; 0 = the sim never waits for this component.
  Component(Bus* bus, std::string name, int64_t lag_window_ticks = 0);
  virtual ~Component() = default;
  Component(const Component&) = delete;
  Component& operator=(const Component&) = delete;

  const component_status_t& status() const { return status_; }

  // Wall-clock duties. The host calls it at least every 100 ms, and at next_poll(). Overrides call
  // Component::Poll.
  virtual void Poll(SteadyTime now);
  virtual SteadyTime next_poll() const { return SteadyTime::max(); }
  // True ends a host that is alone in its process.
  virtual bool done() const { return false; }

  // Says STATUS FAILED with one line of text.
  void Fail(const std::string& error);
  void Stop();

 protected:
  Bus& bus() { return *bus_; }

  // Enters the episode unless it is the one we are in (EPISODE_BEGIN is repeated until everybody is ready):
  // true when it is new and the component must prepare before it calls SayReady.
  bool EnterEpisode(const episode_begin_t& begin);
  void SayReady();
  // True if a message with this header belongs to the episode entered; counted as foreign otherwise.
  bool IsOurs(const header_t& header);
  // A tick was handled; publishes STATUS often enough for flow control.
  void Progress(int64_t tick);
  void PublishStatus();

  component_status_t status_{};

 private:
  Bus* bus_;
  // Of the episode entered.
  int64_t seed_ = 0;
  SteadyTime last_published_{};
  int64_t last_published_tick_ = -1;
};

// A component of a run, on a bus.
using ComponentFactory = std::function<std::unique_ptr<Component>(Bus*)>;

// Works on the bus until SIGINT, SIGTERM or done(). Prints "ready" on stdout once the component exists, an
// error on stderr. Returns the exit code: 0 done, 1 wrong input, 2 failed.
int Host(const std::string& url, const ComponentFactory& make);

// Parses the arguments of a program. Returns its exit code where it ends with that: 0 after --help, 1 after
// one line on stderr about what is wrong.
std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv);

// main() of a component's executable: options --url and those that add_options adds, then Host.
int HostMain(int argc, char** argv, const std::string& description,
             const std::function<void(CLI::App*)>& add_options, const ComponentFactory& make);

// True once SIGINT or SIGTERM came, after InstallStopSignals().
void InstallStopSignals();
bool stop_requested();

}  // namespace evalbus
