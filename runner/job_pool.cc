#include "runner/job_pool.h"

#include "bus/host.h"

namespace evalbus::runner {
namespace {

constexpr int kMaxStarts = 3;

}  // namespace

JobPool::JobPool(std::vector<Job> jobs, int at_once, std::function<void(const std::string&)> on_restart,
                 std::chrono::milliseconds timeout)
    : waiting_(std::make_move_iterator(jobs.begin()), std::make_move_iterator(jobs.end())),
      at_once_(static_cast<size_t>(at_once)),
      on_restart_(std::move(on_restart)),
      processes_(timeout) {}

std::optional<std::string> JobPool::Poll() {
  std::optional<std::string> ended;
  const auto exit = processes_.Poll();
  // The output is read after processes_.Poll(), so that the last lines of a job that has ended are complete.
  for (auto& [name, output] : output_) {
    for (const std::string& line : output.Next()) on_line_(line);
  }
  if (exit) {
    output_.erase(exit->name);
    const auto job = running_.extract(exit->name);
    if (exit->code > 128 && starts_[exit->name] < kMaxStarts) {
      on_restart_(exit->description);
      waiting_.push_front(std::move(job.mapped()));
    } else if (exit->code != 0) {
      exit->Throw(exit->name);
    } else {
      ended = exit->name;
    }
  }
  // Starting many jobs takes time, so Ctrl-C is checked in between.
  while (!waiting_.empty() && running_.size() < at_once_ && !stop_requested()) {
    Job job = std::move(waiting_.front());
    waiting_.pop_front();
    if (on_line_) {
      PipeLines& output = output_[job.name];
      processes_.Start(job.name, job.command, job.log_file, -1, output.writer());
      output.CloseWriter();
    } else {
      processes_.Start(job.name, job.command, job.log_file);
    }
    ++starts_[job.name];
    running_.emplace(job.name, std::move(job));
  }
  return ended;
}

}  // namespace evalbus::runner
