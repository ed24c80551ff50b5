// Finds the run or replay to which an observer (monitor, viz) connects.
#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace evalbus {

struct Address {
  // Run folder (or replayed log) and bus URL. At most one of them may be set. If both are empty, the bus is
  // taken from the environment (EVALBUS_URL) or, if this variable is not set, from the only active run or
  // replay on this machine.
  std::filesystem::path run;
  std::string url;
};

void AddAddressOptions(CLI::App* app, Address* address);

struct Attached {
  std::string url;
  // Number of episodes of the run; 0 if unknown.
  int planned_episodes = 0;
  // Name of the policy; empty if unknown.
  std::string policy;
};

// Chooses the run and its bus. If the run has a private network, moves this process into it. Must be called
// before any thread has started. Throws InputError or EnvironmentError.
Attached Attach(const Address& address);

}  // namespace evalbus
