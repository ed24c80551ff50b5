#include "runner/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <utility>

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

}  // namespace evalbus::runner
