// Child processes of a run: started with their output in a log file, watched, stopped. None outlives its
// launcher.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "bus/wait.h"

namespace evalbus::launch {

class Processes {
 public:
  // A child that does nothing at all for longer than `timeout` is ended: it was stopped, or waits for what
  // does not come. (What is at work, or looks from time to time, does something.)
  explicit Processes(std::chrono::milliseconds timeout = std::chrono::seconds(60)) : timeout_(timeout) {}
  ~Processes() { KillAll(); }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Starts a program; its stdout and stderr are appended to log_file. input: what it has as stdin; -1:
  // nothing to read. Throws EnvironmentError.
  void Start(const std::string& name, const std::vector<std::string>& command,
             const std::filesystem::path& log_file, int input = -1);

  struct Exit {
    std::string name;
    pid_t pid = -1;
    // Exit code, or 128 + signal.
    int code = 0;
    // "evalbus-sim exited with code 1: <last line of its log>"
    std::string description;
    // What it said was wrong, without who said it.
    std::string Error() const;
    // As the error that it ended with: InputError for exit code 1, else EnvironmentError. `who`: in front of
    // it.
    [[noreturn]] void Throw(const std::string& who = "") const;
  };
  // A process that ended since the last call, if any; called at least every 100 ms while they are minded.
  std::optional<Exit> Poll();

  // Changes the priority of the children and of theirs, where this process may: a higher one takes root's
  // rights.
  void SetNice(int nice);
  // SIGTERM, then SIGKILL for who is still there after a second. Returns those that did not end with code
  // 0.
  std::vector<Exit> StopAll();
  void KillAll();

  // Folder of the running program, where its siblings are.
  static std::filesystem::path BinaryFolder();

 private:
  struct Child {
    std::string name;
    pid_t pid;
    std::filesystem::path log_file;
    // What the system counts of what it does, and since when that has not changed.
    std::string life{};
    Wait idle{SteadyTime{}};
  };
  Exit Describe(const Child& child, int status) const;
  bool Hangs(Child* child, SteadyTime now) const;

  std::chrono::milliseconds timeout_;
  // Looking at what they do takes time, and is worth it now and then.
  SteadyTime looked_at_lives_{};
  std::vector<Child> children_;
};

}  // namespace evalbus::launch
