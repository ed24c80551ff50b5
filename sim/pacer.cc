#include "sim/pacer.h"

#include <algorithm>
#include <cmath>

namespace evalbus::sim {

void Pacer::Start(Time now, double period_s) {
  period_ = std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(period_s));
  due_ = now + period_;
  late_ticks_ = 0;
  error_s_.clear();
}

void Pacer::Published(Time now) {
  const auto late = now - due_;
  error_s_.push_back(std::chrono::duration<double>(late).count());
  due_ += period_;
  if (late < period_) return;
  ++late_ticks_;
  due_ = now + period_;
}

void Pacer::Fill(episode_end_t* end) const {
  if (error_s_.empty()) return;
  std::vector<double> sorted = error_s_;
  std::sort(sorted.begin(), sorted.end());
  // The smallest value that so large a share of all does not exceed.
  const auto percentile = [&](double share) {
    return sorted[static_cast<size_t>(std::ceil(share * static_cast<double>(sorted.size()))) - 1];
  };
  end->pacing_error_p50_s = percentile(0.50);
  end->pacing_error_p99_s = percentile(0.99);
  end->pacing_error_max_s = sorted.back();
  end->late_ticks = late_ticks_;
}

}  // namespace evalbus::sim
