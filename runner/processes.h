// Starts the child processes of a run with their output in log files, monitors and stops them. No child
// outlives its launcher.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "bus/wait.h"

namespace evalbus::runner {

class Processes {
 public:
  // A child whose main thread is not scheduled at all for longer than `timeout` is killed, because it is
  // stopped or deadlocked. Working and polling threads are scheduled regularly.
  explicit Processes(std::chrono::milliseconds timeout = std::chrono::seconds(60)) : timeout_(timeout) {}
  ~Processes() { KillAll(); }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Starts a program; its stdout and stderr are appended to log_file. input: file descriptor for its stdin;
  // -1: /dev/null. output: file descriptor for its stdout; -1: log_file. Throws EnvironmentError.
  void Start(const std::string& name, const std::vector<std::string>& command,
             const std::filesystem::path& log_file, int input = -1, int output = -1);

  struct Exit {
    std::string name;
    pid_t pid = -1;
    // Exit code, or 128 + the signal's number.
    int code = 0;
    // Description of the exit, for example "sim exited with code 1: <last line of its log>".
    std::string description;
    // Returns the error message without the program's name.
    std::string Error() const;
    // Throws InputError for exit code 1, otherwise EnvironmentError. `who`: prefix of the message.
    [[noreturn]] void Throw(const std::string& who = "") const;
  };
  // Returns a process that has ended since the last call; nullopt if there is none. Must be called at least
  // every 100 ms while children are monitored.
  std::optional<Exit> Poll();

  // Changes the nice value of the children and their descendants. Decreasing it requires root privileges and
  // otherwise has no effect.
  void SetNice(int nice);
  // Sends SIGTERM, then SIGKILL to processes that are still running after a second. Returns the processes
  // that did not exit with code 0.
  std::vector<Exit> StopAll();
  void KillAll();

  // Returns the folder of the running program, which also contains the other evalbus programs.
  static std::filesystem::path BinaryFolder();

 private:
  struct Child {
    std::string name;
    pid_t pid;
    std::filesystem::path log_file;
    // Activity counters of the process, and the time for which they have not changed.
    std::string life{};
    Wait idle{SteadyTime{}};
  };
  Exit Describe(const Child& child, int status) const;
  bool Hangs(Child* child, SteadyTime now) const;

  std::chrono::milliseconds timeout_;
  // Time at which the counters were last read. They are read only every kBetweenLives, because reading them
  // takes time.
  SteadyTime looked_at_lives_{};
  std::vector<Child> children_;
};

}  // namespace evalbus::runner
