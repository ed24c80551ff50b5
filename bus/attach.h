// How those who look on (monitor, viz) find the run or replay that they listen to.
#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace evalbus {

struct Address {
  // Run folder (or a log that is played) and bus: at most one of them; neither: the bus that the environment
  // names, or the one run or replay on this machine.
  std::filesystem::path run;
  std::string url;
};

void AddAddressOptions(CLI::App* app, Address* address);

struct Attached {
  std::string url;
  // Number of episodes planned; 0 where that is not known.
  int planned_episodes = 0;
  // Name of the policy; empty where that is not known.
  std::string policy;
};

// Decides what to listen to and goes where it can be heard: into the private network of a run that has one,
// before this process has started any thread. Throws InputError, EnvironmentError.
Attached Attach(const Address& address);

}  // namespace evalbus
