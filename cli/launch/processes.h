// Child processes of a run: started with their output in a log file, watched, stopped. None outlives its
// launcher.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::launch {

class Processes {
 public:
  Processes() = default;
  ~Processes() { KillAll(); }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Starts a program; its stdout and stderr are appended to log_file. Throws EnvironmentError.
  void Start(const std::string& name, const std::vector<std::string>& command,
             const std::filesystem::path& log_file);

  struct Exit {
    std::string name;
    // Exit code, or 128 + signal.
    int code = 0;
    // "evalbus-sim exited with code 1: <last line of its log>"
    std::string description;
    // What it said was wrong, without who said it.
    std::string Error() const;
    // As the error that it ended with: InputError for exit code 1, else EnvironmentError.
    [[noreturn]] void Throw() const;
  };
  // A process that ended since the last call, if any.
  std::optional<Exit> Poll();

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
  };
  Exit Describe(const Child& child, int status) const;

  std::vector<Child> children_;
};

}  // namespace evalbus::launch
