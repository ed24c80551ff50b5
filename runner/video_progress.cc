#include "runner/video_progress.h"

#include <fmt/format.h>

#include "results/summary_table.h"

namespace evalbus::runner {

std::string VideoProgress::Text(double done, Time now) const {
  std::string text = fmt::format("{} {:.0f} episode{}: {:.0f} %", verb_, total_, total_ == 1 ? "" : "s",
                                 100 * done / total_);
  // Minimum recorded fraction for estimating the remaining time.
  constexpr double kEnough = 0.02;
  if (const double since = done - first_; since > kEnough * total_) {
    const double elapsed = std::chrono::duration<double>(now - began_).count();
    text += fmt::format(", {} left", results::FormatDuration(elapsed * (total_ - done) / since));
  }
  return text;
}

}  // namespace evalbus::runner
