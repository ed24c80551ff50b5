#include "runner/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "base/input_file.h"
#include "base/run_layout.h"
#include "results/summary_table.h"

namespace evalbus::runner {
namespace {

constexpr char kClearLine[] = "\x1b[K";

}  // namespace

ProgressLine::ProgressLine(size_t episodes, std::string verb)
    : ProgressLine(episodes, std::move(verb), isatty(STDOUT_FILENO) != 0 ? stdout : stderr,
                   isatty(STDOUT_FILENO) != 0, std::chrono::steady_clock::now()) {}

ProgressLine::ProgressLine(size_t episodes, std::string verb, std::FILE* out, bool is_in_place, Time now)
    : episodes_(episodes), verb_(std::move(verb)), out_(out), is_in_place_(is_in_place), last_(now) {}

void ProgressLine::Show(double done, Time now) {
  if (!progress_) progress_.emplace(episodes_, done, now, verb_);
  if (now - last_ < (is_in_place_ ? kInPlace : kBetweenLines)) return;
  last_ = now;
  const std::string text = progress_->Text(done, now);
  fmt::print(out_, "{}", is_in_place_ ? kClearLine + text + "\r" : text + "\n");
  std::fflush(out_);
  is_shown_ = true;
}

void ProgressLine::Clear() {
  if (!is_in_place_ || !is_shown_) return;
  fmt::print(out_, "{}", kClearLine);
  std::fflush(out_);
  is_shown_ = false;
}

JobsProgress::JobsProgress(size_t jobs, std::string what, const std::vector<std::filesystem::path>& runs,
                           int episodes)
    : JobsProgress(jobs, std::move(what), runs, episodes, stdout, isatty(fileno(stdout)) != 0,
                   std::chrono::steady_clock::now()) {}

JobsProgress::JobsProgress(size_t jobs, std::string what, const std::vector<std::filesystem::path>& runs,
                           int episodes, std::FILE* out, bool is_terminal, Time now)
    : jobs_(jobs),
      what_(std::move(what)),
      episodes_(episodes),
      out_(out),
      is_terminal_(is_terminal),
      began_(now),
      last_(now - ProgressLine::kInPlace) {
  for (const std::filesystem::path& run : runs) runs_.push_back({.lines = run / kEpisodesJsonl});
}

// Reads only files that have changed since the last call.
int64_t JobsProgress::CountEpisodes() {
  int64_t done = 0;
  for (CountedRun& run : runs_) {
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(run.lines, error);
    if (!error && size != run.size) {
      run.size = size;
      run.episodes = std::min<int64_t>(CountLines(run.lines), episodes_);
    }
    done += run.episodes;
  }
  return done;
}

void JobsProgress::Show(size_t done, Time now) {
  if (!is_terminal_ || now - last_ < ProgressLine::kInPlace) return;
  last_ = now;
  std::string text = fmt::format("{} of {} {}, ", done, jobs_, what_);
  if (!runs_.empty())
    text +=
        fmt::format("{} of {} episodes, ", CountEpisodes(), runs_.size() * static_cast<size_t>(episodes_));
  text += results::FormatDuration(std::chrono::duration<double>(now - began_).count());
  fmt::print(out_, "{}{}\r", kClearLine, text);
  std::fflush(out_);
  is_shown_ = true;
}

void JobsProgress::Clear() {
  if (is_shown_) fmt::print(out_, "{}", kClearLine);
  is_shown_ = false;
}

}  // namespace evalbus::runner
