#include "report/web/reader_threads.h"

#include <iterator>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace evalbus::report {

using std::chrono::steady_clock;

ReaderThreads::~ReaderThreads() { Stop(std::chrono::hours(24 * 365)); }

bool ReaderThreads::Add(std::function<Report()> work, GiveUp give_up) {
  const std::lock_guard lock(mutex_);
  if (stops_ || waiting_.size() >= limits_.waiting) return false;
  waiting_.push_back({std::move(work), std::move(give_up)});
  Start();
  return true;
}

void ReaderThreads::Start() {
  while (!stops_ && !waiting_.empty() && num_stuck_ < limits_.stuck &&
         running_.size() - num_stuck_ < limits_.at_once) {
    running_.push_back(waiting_.front());
    const auto job = std::prev(running_.end());
    job->started = steady_clock::now();
    try {
      std::thread([this, job] { Run(job); }).detach();
    } catch (const std::system_error&) {
      // The system cannot start more threads. Poll() will try again.
      running_.erase(job);
      return;
    }
    waiting_.pop_front();
  }
}

void ReaderThreads::Run(std::list<Job>::iterator job) {
  const Report report_late = job->work();
  bool is_late = false;
  {
    const std::lock_guard lock(mutex_);
    is_late = std::exchange(job->is_reported, true);
  }
  // The result is delivered while the job still counts as running, because Stop() waits until all results are
  // delivered.
  report_late(is_late);
  const std::lock_guard lock(mutex_);
  num_stuck_ -= job->is_stuck;
  running_.erase(job);
  Start();
  changed_.notify_all();
}

void ReaderThreads::Poll(SteadyTime now) {
  std::vector<GiveUp> given_up;
  {
    const std::lock_guard lock(mutex_);
    for (Job& job : running_) {
      if (job.is_reported || now - job.started <= limits_.timeout) continue;
      job.is_reported = job.is_stuck = true;
      ++num_stuck_;
      given_up.push_back(job.give_up);
    }
    Start();
    if (num_stuck_ >= limits_.stuck) {
      for (Job& job : std::exchange(waiting_, {})) given_up.push_back(std::move(job.give_up));
    }
  }
  for (const GiveUp& give_up : given_up) give_up();
}

bool ReaderThreads::Pause(std::chrono::milliseconds duration) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, duration, [this] { return stops_; });
}

bool ReaderThreads::Stop(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  stops_ = true;
  waiting_.clear();
  changed_.notify_all();
  return changed_.wait_for(lock, timeout, [this] { return running_.empty(); });
}

}  // namespace evalbus::report
