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
  // Run folder, or what is replayed: a folder or a log. Empty where it has none.
  std::filesystem::path folder;
  bool is_replay = false;
  // True where its network is another one than ours: nothing is heard of it here.
  bool other_network = false;
};

// The option of a replay's metrics that names what is played. Read here and by nobody else.
inline constexpr char kReplayOption[] = "--replay";

// One entry per bus, from the command lines of the component processes that this user has started; observers
// have none.
std::vector<LiveRun> FindLiveRuns(const std::filesystem::path& proc = "/proc");

// Those of this run folder or log, and of the runs of this suite.
std::vector<LiveRun> LiveRunsOf(const std::vector<LiveRun>& runs, const std::filesystem::path& folder);

// The run with this URL (empty: any). Throws InputError, one line, if there is none or more than one.
LiveRun ChooseLiveRun(const std::vector<LiveRun>& runs, const std::string& url = "");

// Moves this process, before it has started any thread, into the network of the run. Throws EnvironmentError,
// with the fix, if that is not allowed or the run belongs to another user.
void JoinNetwork(const LiveRun& run);

}  // namespace evalbus
