// Work that reads files, each piece on a thread of its own, so that a file system that does not answer holds
// up nothing but the work that waits for it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <mutex>

#include "bus/bus.h"

namespace evalbus::launch {

class ReaderThreads {
 public:
  struct Limits {
    // Pieces of work that run at the same time, and that wait to.
    size_t at_once = 4, waiting = 64;
    // Work that takes longer is given up. Its thread cannot be ended and stays until its file answers.
    std::chrono::seconds timeout{30};
    // While so many threads are stuck nothing is started, and what waits is given up, too.
    size_t stuck = 16;
  };
  // Tells a result to whoever asked for it. is_late: give_up has been called, or is being called. Neither may
  // throw.
  using Tell = std::function<void(bool is_late)>;
  using GiveUp = std::function<void()>;

  explicit ReaderThreads(const Limits& limits) : limits_(limits) {}
  // Waits for all work that runs.
  ~ReaderThreads();
  ReaderThreads(const ReaderThreads&) = delete;
  ReaderThreads& operator=(const ReaderThreads&) = delete;

  // work: runs on a thread, must not throw, and returns what is then called there. give_up: called in Poll().
  // False if too much waits: nothing was added.
  bool Add(std::function<Tell()> work, GiveUp give_up);
  // Gives up what takes too long, and starts what may run in its place; called now and then.
  void Poll(SteadyTime now);
  // For work that waits for a file: false once Stop() was called.
  bool Pause(std::chrono::milliseconds duration);
  // Starts nothing any more. False if work still runs after `timeout`: what it refers to must stay.
  bool Stop(std::chrono::milliseconds timeout);

 private:
  struct Job {
    std::function<Tell()> work;
    GiveUp give_up;
    SteadyTime started{};
    bool is_told = false, is_stuck = false;
  };

  // With the lock: starts what waits, as far as the limits and the system allow.
  void Start();
  void Run(std::list<Job>::iterator job);

  const Limits limits_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stops_ = false;
  std::deque<Job> waiting_;
  // Each with its thread.
  std::list<Job> running_;
  size_t num_stuck_ = 0;
};

}  // namespace evalbus::launch
