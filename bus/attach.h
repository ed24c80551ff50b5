// How observers (monitor, viz) find the run or replay to which they connect.
#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace evalbus {

struct Address {
  // Run folder (or replayed log) and bus URL. At most one of them may be set. If both are empty, the bus is
  // the one that the environment names, or that of the only active run or replay on this machine.
  std::filesystem::path run;
  std::string url;
};

void AddAddressOptions(CLI::App* app, Address* address);

struct Attached {
  std::string url;
  // 0 if unknown.
  int planned_episodes = 0;
  // Empty if unknown.
  std::string policy;
};

// Chooses the run and its bus. If the run has a private network, moves this process into it; therefore call
// it before any thread has started. Throws InputError, EnvironmentError.
Attached Attach(const Address& address);

}  // namespace evalbus
