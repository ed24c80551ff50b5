#include "runner/processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

#include "base/disk.h"
#include "base/errors.h"
#include "base/installed.h"

namespace evalbus::runner {
namespace {

// Time that processes have to exit after SIGTERM. Short enough for Ctrl-C to end a run within two seconds.
constexpr std::chrono::seconds kStopping{1};
// Interval at which the children's activity counters are read.
constexpr std::chrono::milliseconds kBetweenLives{500};

// Returns the last nonempty line of a log, within its last few kilobytes.
std::string LastLine(const std::filesystem::path& file) {
  constexpr std::streamoff kTail = 8192;
  std::ifstream stream(file, std::ios::ate);
  stream.seekg(std::max<std::streamoff>(0, std::streamoff(stream.tellg()) - kTail));
  std::string line, last;
  while (std::getline(stream, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

// Returns the part of the exit description that quotes the log's last line. If the process exited by itself,
// only an error line is quoted; if it was killed, any line except routine lines. A line that is not a log
// message, such as a result or a message of the C library, is only called the last line, because it may be
// unrelated.
std::string LastWords(const std::string& name, const std::string& line, bool by_itself) {
  if (line.empty()) return "";
  if (by_itself) return line.find("error: ") == std::string::npos ? "" : ": " + line;
  if (line == name + " ready" || line.find(" [info] ") != std::string::npos ||
      line.find(" [debug] ") != std::string::npos) {
    return "";
  }
  const size_t level = line.find("] ");
  const bool is_logged = line.find(" [") < level && level != std::string::npos;
  return is_logged ? ": " + line.substr(level + 2) : "; its last line: " + line;
}

// Returns activity counters of a process's main thread: CPU time and context switches. Empty if the system
// does not provide them.
std::string Life(pid_t pid) {
  const std::filesystem::path thread =
      std::filesystem::path("/proc") / std::to_string(pid) / "task" / std::to_string(pid);
  const auto read = [&](const char* name) {
    std::ifstream stream(thread / name);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string status = read("status");
  const size_t switches = status.find("voluntary_ctxt_switches");
  return switches == std::string::npos ? "" : read("stat") + status.substr(switches);
}

}  // namespace

std::filesystem::path Processes::BinaryFolder() { return ProgramFolder(); }

void Processes::Start(const std::string& name, const std::vector<std::string>& command,
                      const std::filesystem::path& log_file, int input, int output) {
  if (access(command[0].c_str(), X_OK) != 0) {
    throw EnvironmentError("cannot start " + command[0] + ": " + std::strerror(errno));
  }
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0) throw EnvironmentError("cannot write " + log_file.string() + ": " + std::strerror(errno));
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    // Between fork and exec, only async-signal-safe functions may be called.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);       // the launcher died in between
    close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);  // for example liblcm's socket
    setpgid(0, 0);  // Ctrl-C reaches only the launcher, which then stops the children in order
    dup2(input < 0 ? open("/dev/null", O_RDONLY) : input, STDIN_FILENO);
    dup2(output < 0 ? log : output, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  const int error = errno;
  close(log);
  if (pid < 0) throw EnvironmentError("cannot start " + name + ": " + std::strerror(error));
  children_.push_back({name, pid, log_file, "", Wait(std::chrono::steady_clock::now())});
}

Processes::Exit Processes::Describe(const Child& child, int status) const {
  Exit exit;
  exit.name = child.name;
  exit.pid = child.pid;
  exit.code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  exit.description =
      child.name + (WIFSIGNALED(status) ? std::string(" was ended by signal ") + strsignal(WTERMSIG(status))
                                        : " exited with code " + std::to_string(exit.code));
  const std::string last = LastWords(child.name, LastLine(child.log_file), WIFEXITED(status));
  // If the disk is full, the log cannot contain the error.
  const std::string disk = last.empty() ? WhyNotWritable(child.log_file.parent_path()) : "";
  exit.description += last;
  if (!disk.empty()) exit.description += "; " + disk;
  return exit;
}

std::string Processes::Exit::Error() const {
  constexpr std::string_view kMark = "error: ";
  const size_t mark = description.find(kMark);
  return mark == std::string::npos ? description : description.substr(mark + kMark.size());
}

void Processes::Exit::Throw(const std::string& who) const {
  const std::string error = (who.empty() || Error() == description ? "" : who + ": ") + Error();
  if (code == 1) throw InputError(error);
  throw EnvironmentError(error);
}

bool Processes::Hangs(Child* child, SteadyTime now) const {
  if (now == looked_at_lives_) {
    std::string life = Life(child->pid);
    if (life.empty() || life != child->life) child->idle = Wait(now);
    child->life = std::move(life);
  }
  return child->idle.Elapsed(now) > timeout_;
}

std::optional<Processes::Exit> Processes::Poll() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_at_lives_ >= kBetweenLives) looked_at_lives_ = now;
  for (auto child = children_.begin(); child != children_.end(); ++child) {
    int status = 0;
    const bool hangs = Hangs(&*child, now);
    if (hangs) kill(child->pid, SIGKILL);
    if (waitpid(child->pid, &status, hangs ? 0 : WNOHANG) != child->pid) continue;
    Exit exit = Describe(*child, status);
    if (hangs) {
      exit.description = fmt::format("{} hung: no progress for {:g} s", child->name,
                                     std::chrono::duration<double>(timeout_).count());
    }
    children_.erase(child);
    return exit;
  }
  return std::nullopt;
}

void Processes::SetNice(int nice) {
  for (const Child& child : children_) setpriority(PRIO_PGRP, static_cast<id_t>(child.pid), nice);
}

std::vector<Processes::Exit> Processes::StopAll() {
  for (const Child& child : children_) kill(child.pid, SIGTERM);
  std::vector<Exit> failed;
  const auto deadline = std::chrono::steady_clock::now() + kStopping;
  while (!children_.empty() && std::chrono::steady_clock::now() < deadline) {
    if (const auto exit = Poll()) {
      if (exit->code != 0) failed.push_back(*exit);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  for (const Child& child : children_)
    failed.push_back({child.name, child.pid, 128 + SIGKILL, child.name + " did not stop"});
  KillAll();
  return failed;
}

void Processes::KillAll() {
  for (const Child& child : children_) {
    kill(child.pid, SIGKILL);
    waitpid(child.pid, nullptr, 0);
  }
  children_.clear();
}

}  // namespace evalbus::runner
