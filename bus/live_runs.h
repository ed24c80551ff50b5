// Runs and replays that go on on this machine now, as their processes show them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace evalbus {

struct LiveRun {
  // One of its processes.
  pid_t pid = -1;
  std::string url;
  // Run folder; empty where it has none.
  std::filesystem::path folder;
  // True where its network is another one than ours: nothing is heard of it here.
  bool other_network = false;
};

// One entry per bus, from the command lines of evalbus' component processes; those who only look on are none.
std::vector<LiveRun> FindLiveRuns(const std::filesystem::path& proc = "/proc");

// The run with this URL (empty: any). Throws InputError, one line, if there is none or more than one.
LiveRun ChooseLiveRun(const std::vector<LiveRun>& runs, const std::string& url);

// Moves this process, before it has started any thread, into the network of the run. Throws EnvironmentError,
// with the fix, if that is not allowed.
void JoinNetwork(const LiveRun& run);

}  // namespace evalbus
