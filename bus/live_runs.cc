#include "bus/live_runs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/errors.h"
#include "base/number_from.h"
#include "bus/private_network.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Returns the strings of a file in which each string is terminated by a NUL.
std::vector<std::string> Strings(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::string> strings;
  for (std::string string; std::getline(stream, string, '\0');) strings.push_back(string);
  return strings;
}

// Returns the value of "--name VALUE" or "--name=VALUE"; empty if the option is missing.
std::string OptionOf(const std::vector<std::string>& arguments, const std::string& name) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == name && i + 1 < arguments.size()) return arguments[i + 1];
    if (arguments[i].starts_with(name + "=")) return arguments[i].substr(name.size() + 1);
  }
  return "";
}

// Bus of a process, from its command line or its environment.
std::string UrlOf(const fs::path& process, const std::vector<std::string>& arguments) {
  std::string url = OptionOf(arguments, "--url");
  if (!url.empty()) return url;
  const std::string variable = std::string(kUrlVariable) + "=";
  for (const std::string& entry : Strings(process / "environ")) {
    if (entry.starts_with(variable)) return entry.substr(variable.size());
  }
  return "";
}

// Returns the folder of a run or replay: the replayed folder, the folder of the options file that a launcher
// passes, or the value of --out.
fs::path FolderOf(const fs::path& process, const std::vector<std::string>& arguments) {
  fs::path folder = OptionOf(arguments, kReplayOption);
  if (folder.empty()) folder = fs::path(OptionOf(arguments, "--options")).parent_path();
  if (folder.empty()) folder = OptionOf(arguments, "--out");
  if (folder.empty() || folder.is_absolute()) return folder;
  std::error_code error;
  return fs::read_symlink(process / "cwd", error) / folder;
}

// Returns whether this user started the process. Other processes named evalbus-sim are not trusted, because
// any user can start one.
bool IsOurs(const struct stat& process) { return process.st_uid == geteuid(); }

bool Enter(int namespaces, const char* name, int kind) {
  const int fd = openat(namespaces, name, O_RDONLY | O_CLOEXEC);
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
    run.pid = NumberFrom<pid_t>(name).value_or(0);
    if (run.pid == 0 || run.pid == getpid()) continue;
    struct stat process {};
    if (stat(entry.path().c_str(), &process) != 0 || !IsOurs(process)) continue;
    const auto arguments = Strings(entry.path() / "cmdline");
    if (arguments.empty()) continue;
    const std::string program = fs::path(arguments[0]).filename();
    if (!program.starts_with("evalbus-") || program == "evalbus-monitor" || program == "evalbus-viz")
      continue;
    run.url = UrlOf(entry.path(), arguments);
    if (run.url.empty()) continue;
    run.folder = FolderOf(entry.path(), arguments);
    run.is_replay = !OptionOf(arguments, kReplayOption).empty();
    const fs::path network = fs::read_symlink(entry.path() / "ns/net", error);
    run.other_network = !network.empty() && network != our_network;
    const auto known = std::find_if(runs.begin(), runs.end(), [&](const LiveRun& other) {
      return other.url == run.url && other.other_network == run.other_network;
    });
    if (known == runs.end()) {
      runs.push_back(run);
    } else if (known->folder.empty()) {
      known->folder = run.folder;
      known->is_replay = run.is_replay;
    }
  }
  return runs;
}

std::vector<LiveRun> LiveRunsOf(const std::vector<LiveRun>& runs, const fs::path& folder) {
  // Normalizes the spelling of paths, so that "runs/a/" equals "runs/a".
  const auto canonical = [](const fs::path& path) {
    std::error_code error;
    const fs::path plain = fs::weakly_canonical(path, error);
    return plain.has_filename() ? plain : plain.parent_path();
  };
  const auto is_it = [&, wanted = canonical(folder)](const fs::path& path) {
    return !path.empty() && canonical(path) == wanted;
  };
  std::vector<LiveRun> fitting;
  std::ranges::copy_if(runs, std::back_inserter(fitting), [&](const LiveRun& run) {
    return is_it(run.folder) || (!run.is_replay && is_it(run.folder.parent_path()));
  });
  return fitting;
}

LiveRun ChooseLiveRun(const std::vector<LiveRun>& runs, const std::string& url) {
  std::vector<LiveRun> fitting;
  std::string urls;
  for (const LiveRun& run : runs) {
    if (!url.empty() && run.url != url) continue;
    fitting.push_back(run);
    urls += (urls.empty() ? "" : ", ") + (run.folder.empty()
                                              ? run.url
                                              : fmt::format("{}{} on {}", run.is_replay ? "replay of " : "",
                                                            fs::proximate(run.folder).string(), run.url));
  }
  if (fitting.size() == 1) return fitting[0];
  if (fitting.empty()) {
    throw InputError(url.empty() ? "no active run on this machine; pass its bus with --url"
                                 : "no active run on this machine has the bus " + url);
  }
  throw InputError("more than one active run: pass the folder of one, or its bus with --url (" + urls + ")");
}

void JoinNetwork(const LiveRun& run) {
  std::string why;
  const int namespaces =
      open(fmt::format("/proc/{}/ns", run.pid).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  struct stat process {};
  if (namespaces < 0 || fstat(namespaces, &process) != 0) {
    why = std::strerror(errno);
  } else if (!IsOurs(process)) {
    why = fmt::format("process {} belongs to another user", run.pid);
  } else if (!Enter(namespaces, "net", CLONE_NEWNET) &&
             // For an unprivileged user, the network namespace is owned by a user namespace, which must be
             // entered first.
             !(Enter(namespaces, "user", CLONE_NEWUSER) && Enter(namespaces, "net", CLONE_NEWNET))) {
    why = std::strerror(errno);
  }
  if (namespaces >= 0) close(namespaces);
  if (why.empty()) return;
  throw EnvironmentError(fmt::format(
      "the run is in a private network namespace, which this process cannot join: {} (as the user "
      "who started it: nsenter -t {} -U -n --preserve-credentials evalbus monitor --url '{}')",
      why, run.pid, run.url));
}

}  // namespace evalbus
