#include "sim/pacer.h"

namespace evalbus::sim {

void Pacer::Start(Time now, double period_s) {
  period_ = std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(period_s));
  due_ = now + period_;
  late_ticks_ = 0;
  error_.Clear();
}

void Pacer::Published(Time now) {
  const auto late = now - due_;
  error_.Add(late);
  due_ += period_;
  if (late < period_) return;
  ++late_ticks_;
  due_ = now + period_;
}

}  // namespace evalbus::sim
