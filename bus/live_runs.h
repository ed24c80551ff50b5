// Active runs and replays on this machine, found through their processes.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace evalbus {

struct LiveRun {
  // One of the run's processes.
  pid_t pid = -1;
  std::string url;
  // Run folder, or the replayed folder or log. Empty if unknown.
  std::filesystem::path folder;
  bool is_replay = false;
  // True if the run is in another network namespace, so that this process does not receive its messages.
  bool other_network = false;
};

// Option of a replay's metrics process that names the replayed folder or log. Only FindLiveRuns()
// reads it, from the process's command line.
inline constexpr char kReplayOption[] = "--replay";

// Returns one entry per bus, found through the command lines and environments of this user's component
// processes. Buses with the same URL in this and in another network namespace are two entries. Observers are
// not listed.
std::vector<LiveRun> FindLiveRuns(const std::filesystem::path& proc = "/proc");

// Returns the runs whose folder is this run folder, log or suite.
std::vector<LiveRun> LiveRunsOf(const std::vector<LiveRun>& runs, const std::filesystem::path& folder);

// Returns the run with this URL, or the only run if `url` is empty. Throws InputError, one line, if there is
// no such run or more than one.
LiveRun ChooseLiveRun(const std::vector<LiveRun>& runs, const std::string& url = "");

// Moves this process into the network namespace of the run. Must be called before any thread has started.
// Throws EnvironmentError, with the fix, if that is not permitted or the run belongs to another user.
void JoinNetwork(const LiveRun& run);

}  // namespace evalbus
