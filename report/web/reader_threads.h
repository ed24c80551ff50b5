// Runs each job that reads files on its own thread. A file system that does not respond then blocks only the
// jobs that read from it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <mutex>

#include "bus/bus.h"

namespace evalbus::report {

class ReaderThreads {
 public:
  struct Limits {
    // Maximum numbers of running jobs and of waiting jobs.
    size_t at_once = 4, waiting = 64;
    // A job that takes longer is abandoned. Its thread cannot be stopped and continues to exist until the
    // file system responds.
    std::chrono::seconds timeout{30};
    // When this number of threads is stuck, no further jobs are started, and waiting jobs are abandoned.
    size_t stuck = 16;
  };
  // Delivers a job's result. is_late: GiveUp has been called or is being called. Neither function may throw.
  using Report = std::function<void(bool is_late)>;
  using GiveUp = std::function<void()>;

  explicit ReaderThreads(const Limits& limits) : limits_(limits) {}
  // Waits for all running jobs.
  ~ReaderThreads();
  ReaderThreads(const ReaderThreads&) = delete;
  ReaderThreads& operator=(const ReaderThreads&) = delete;

  // Adds a job. Returns false if too many jobs are waiting or Stop() was called. `work` runs on one of the
  // reader threads and must not throw. The function that it returns is called on the same thread. `give_up`
  // is called in Poll() if the job is abandoned.
  bool Add(std::function<Report()> work, GiveUp give_up);
  // Abandons jobs that take too long, and starts waiting jobs. Must be called regularly, because both happen
  // only here.
  void Poll(SteadyTime now);
  // Sleeps in a job that waits for a file; returns false after Stop() was called.
  bool Pause(std::chrono::milliseconds duration);
  // Prevents further jobs from starting, discards waiting ones without calling GiveUp, and waits for running
  // ones. Returns false if some are still running after `timeout`. Objects that they use must then not be
  // destroyed.
  bool Stop(std::chrono::milliseconds timeout);

 private:
  struct Job {
    std::function<Report()> work;
    GiveUp give_up;
    SteadyTime started{};
    bool is_reported = false, is_stuck = false;
  };

  // Starts waiting jobs, within the limits and the system's resources. Requires the lock.
  void Start();
  void Run(std::list<Job>::iterator job);

  const Limits limits_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stops_ = false;
  std::deque<Job> waiting_;
  // Jobs that have a thread.
  std::list<Job> running_;
  size_t num_stuck_ = 0;
};

}  // namespace evalbus::report
