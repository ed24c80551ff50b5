#include "bus/live_runs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/errors.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> CommandLine(const fs::path& process) {
  std::ifstream stream(process / "cmdline", std::ios::binary);
  std::vector<std::string> arguments;
  for (std::string argument; std::getline(stream, argument, '\0');) arguments.push_back(argument);
  return arguments;
}

// Value of "--name VALUE" or "--name=VALUE".
std::string Option(const std::vector<std::string>& arguments, const std::string& name) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == name && i + 1 < arguments.size()) return arguments[i + 1];
    if (arguments[i].starts_with(name + "=")) return arguments[i].substr(name.size() + 1);
  }
  return "";
}

bool Enter(const fs::path& name, int kind) {
  const int fd = open(name.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool entered = setns(fd, kind) == 0;
  const int error = errno;
  close(fd);
  errno = error;
  return entered;
}

}  // namespace

std::vector<LiveRun> FindLiveRuns(const fs::path& proc) {
  std::error_code error;
  const fs::path our_network = fs::read_symlink(proc / "self/ns/net", error);
  std::vector<LiveRun> runs;
  for (const auto& entry : fs::directory_iterator(proc, error)) {
    const std::string name = entry.path().filename();
    LiveRun run;
    const auto parsed = std::from_chars(name.data(), name.data() + name.size(), run.pid);
    if (parsed.ptr != name.data() + name.size() || run.pid == getpid()) continue;
    const auto arguments = CommandLine(entry.path());
    if (arguments.empty()) continue;
    const std::string program = fs::path(arguments[0]).filename();
    if (!program.starts_with("evalbus-") || program == "evalbus-monitor" || program == "evalbus-viz")
      continue;
    run.url = Option(arguments, "--url");
    if (run.url.empty()) continue;
    if (program == "evalbus-recorder" || program == "evalbus-sim") run.folder = Option(arguments, "--out");
    const fs::path network = fs::read_symlink(entry.path() / "ns/net", error);
    run.other_network = !network.empty() && network != our_network;
    const auto known = std::find_if(runs.begin(), runs.end(), [&](const LiveRun& other) {
      return other.url == run.url && other.other_network == run.other_network;
    });
    if (known == runs.end()) {
      runs.push_back(run);
    } else if (known->folder.empty()) {
      known->folder = run.folder;
    }
  }
  return runs;
}

LiveRun ChooseLiveRun(const std::vector<LiveRun>& runs, const std::string& url) {
  std::vector<LiveRun> fitting;
  std::string urls;
  for (const LiveRun& run : runs) {
    if (!url.empty() && run.url != url) continue;
    fitting.push_back(run);
    urls += (urls.empty() ? "" : ", ") + (run.folder.empty() ? run.url : run.folder.string());
  }
  if (fitting.size() == 1) return fitting[0];
  if (fitting.empty()) {
    throw InputError(url.empty() ? "no run goes on on this machine; name its bus with --url"
                                 : "no run on this machine has the bus " + url);
  }
  throw InputError("more than one run goes on: name the folder of one, or its bus with --url (" + urls + ")");
}

void JoinNetwork(const LiveRun& run) {
  const fs::path namespaces = fs::path("/proc") / std::to_string(run.pid) / "ns";
  if (Enter(namespaces / "net", CLONE_NEWNET)) return;
  // Of a user without privileges, the network is owned by a user namespace that came with it.
  if (Enter(namespaces / "user", CLONE_NEWUSER) && Enter(namespaces / "net", CLONE_NEWNET)) return;
  throw EnvironmentError(fmt::format(
      "the run is in a private network namespace and cannot be heard from outside: {} (as the user "
      "who runs it: nsenter -t {} -U -n --preserve-credentials evalbus monitor --url '{}')",
      std::strerror(errno), run.pid, run.url));
}

}  // namespace evalbus
