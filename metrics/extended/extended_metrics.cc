#include "metrics/extended/extended_metrics.h"

#include <algorithm>
#include <cmath>

// Every extended metric: the one line that adds it.
#include "metrics/extended/collision_events.h"
#include "metrics/extended/contact_time.h"
#include "metrics/extended/grasp_statistics.h"
#include "metrics/extended/joint_limit_margin.h"
#include "metrics/extended/log_dimensionless_jerk.h"
#include "metrics/extended/mechanical_work.h"
#include "metrics/extended/min_clearance.h"
#include "metrics/extended/peak_penetration.h"
#include "metrics/extended/peak_wrist_acceleration.h"
#include "metrics/extended/peak_wrist_speed.h"
#include "metrics/extended/spectral_arc_length.h"

namespace evalbus::metrics {

std::vector<ExtendedMetricType>& ExtendedMetricTypes() {
  static std::vector<ExtendedMetricType> types;
  return types;
}

ExtendedMetrics::ExtendedMetrics(const MetricsConfig& config)
    : dt_(config.control_dt), last_wrist_(config.arms.size()), wrist_speed_(config.arms.size()) {
  for (const ExtendedMetricType& type : ExtendedMetricTypes()) {
    entries_.push_back({type.names(config), type.make(config)});
  }
  std::sort(entries_.begin(), entries_.end(),
            [](const Entry& a, const Entry& b) { return a.names[0].name < b.names[0].name; });
  for (const Entry& entry : entries_) {
    for (const ValueName& value : entry.names) {
      names_.push_back(value.name);
      units_.push_back(value.unit);
    }
  }
  Start();
}

void ExtendedMetrics::Start() {
  for (const Entry& entry : entries_) entry.metric->Start();
}

void ExtendedMetrics::Add(const Sample& sample, const RobotContacts& contacts, bool in_a_row) {
  for (size_t k = 0; k < last_wrist_.size(); ++k) {
    const std::array<double, 3>& p = sample.arm[k].wrist_position;
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += (p[i] - last_wrist_[k][i]) * (p[i] - last_wrist_[k][i]);
    wrist_speed_[k] = in_a_row ? std::sqrt(sum) / dt_ : 0;
    last_wrist_[k] = p;
  }
  const DerivedSample derived{sample, in_a_row, wrist_speed_, contacts};
  for (const Entry& entry : entries_) entry.metric->Add(derived);
}

void ExtendedMetrics::SetNames(extended_metrics_t* extended) const {
  extended->num_values = static_cast<int32_t>(names_.size());
  extended->name = names_;
  extended->unit = units_;
  extended->value_mixed.resize(names_.size());
}

void ExtendedMetrics::Values(extended_metrics_t* extended) const {
  SetNames(extended);
  std::span<double> rest = extended->value_mixed;
  for (const Entry& entry : entries_) {
    entry.metric->Values(rest.first(entry.names.size()));
    rest = rest.subspan(entry.names.size());
  }
}

void ExtendedMetrics::FinalValues(extended_metrics_t* extended) const {
  SetNames(extended);
  std::span<double> rest = extended->value_mixed;
  for (const Entry& entry : entries_) {
    entry.metric->FinalValues(rest.first(entry.names.size()));
    rest = rest.subspan(entry.names.size());
  }
}

}  // namespace evalbus::metrics
