// Runs commands, so many at a time, each in a process with a log of its own.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/launch/processes.h"

namespace evalbus::launch {

struct Job {
  std::string name;
  std::vector<std::string> command;
  std::filesystem::path log_file;
};

// How often a pool is asked.
constexpr auto kJobPoll = std::chrono::milliseconds(20);

class JobPool {
 public:
  // `on_restart` gets one line about a job that is started again. timeout: as in Processes.
  JobPool(std::vector<Job> jobs, int at_once, std::function<void(const std::string&)> on_restart,
          std::chrono::milliseconds timeout = std::chrono::seconds(60));
  // Stops who runs: jobs have processes of their own, and take them with them in order.
  ~JobPool() { processes_.StopAll(); }

  // Starts what may start. Returns the name of a job that has ended well since the last call, if any. One
  // that was ended by a signal, or hangs, is started again, three times at most. Throws InputError or
  // EnvironmentError, with its name and the last line of its log, for one that failed.
  std::optional<std::string> Poll();
  bool done() const { return waiting_.empty() && running_.empty(); }

 private:
  std::deque<Job> waiting_;
  std::map<std::string, Job> running_;
  std::map<std::string, int> starts_;
  size_t at_once_;
  std::function<void(const std::string&)> on_restart_;
  Processes processes_;
};

}  // namespace evalbus::launch
