// Runs commands in parallel, up to a limit. Each command runs in a process with its own log.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runner/pipe_lines.h"
#include "runner/processes.h"

namespace evalbus::runner {

struct Job {
  std::string name;
  std::vector<std::string> command;
  std::filesystem::path log_file;
};

// Interval at which JobPool::Poll() should be called.
constexpr auto kJobPoll = std::chrono::milliseconds(20);

class JobPool {
 public:
  // `on_restart` receives one line about each job that is restarted. timeout: see Processes.
  JobPool(std::vector<Job> jobs, int at_once, std::function<void(const std::string&)> on_restart,
          std::chrono::milliseconds timeout = std::chrono::seconds(60));
  // Stops the running jobs with SIGTERM, so that they can stop their own child processes.
  ~JobPool() { processes_.StopAll(); }

  // Passes each line that a job prints on standard output to on_line() instead of the job's log. Must be
  // called before the first Poll().
  void ReadOutput(std::function<void(const std::string&)> on_line) { on_line_ = std::move(on_line); }

  // Starts as many jobs as the limit allows. Returns the name of a job that has succeeded since the last
  // call; nullopt if there is none. A job that was killed by a signal or hangs is restarted; a job is started
  // at most three times. Throws InputError or EnvironmentError, with the job's name and the last line of its
  // log, if a job failed.
  std::optional<std::string> Poll();
  bool done() const { return waiting_.empty() && running_.empty(); }

 private:
  std::deque<Job> waiting_;
  std::map<std::string, Job> running_;
  // Standard output of the running jobs; empty unless ReadOutput() was called.
  std::map<std::string, PipeLines> output_;
  std::map<std::string, int> starts_;
  size_t at_once_;
  std::function<void(const std::string&)> on_restart_, on_line_;
  Processes processes_;
};

}  // namespace evalbus::runner
