#include "metrics/extended/extended_metrics.h"

#include <span>
#include <stdexcept>

#include "lcmtypes/metric_catalog.h"
#include "metrics/extended/contact_metrics.h"
#include "metrics/extended/grasp_metrics.h"
#include "metrics/extended/motion_metrics.h"
#include "metrics/extended/spectral_arc_length.h"

namespace evalbus::metrics {
namespace {

struct Type {
  std::span<const char* const> names;
  std::unique_ptr<ExtendedMetric> (*make)(const MetricsConfig& config);
};

template <class Metric>
constexpr Type Of() {
  return {Metric::kNames, [](const MetricsConfig& config) -> std::unique_ptr<ExtendedMetric> {
            return std::make_unique<Metric>(config);
          }};
}

// All extended metrics in the order of their first names, which is the order in the message.
constexpr Type kTypes[] = {
    Of<CommandJerk>(),      Of<ContactTime>(),
    Of<CollisionEvents>(),  Of<FirstTouch>(),
    Of<GraspStatistics>(),  Of<GripForce>(),
    Of<IdleTime>(),         Of<LogDimensionlessJerk>(),
    Of<MechanicalWork>(),   Of<MinClearance>(),
    Of<JointLimitMargin>(), Of<JointTorqueMargin>(),
    Of<ContactForces>(),    Of<PeakPenetration>(),
    Of<UnwantedContact>(),  Of<PeakWristAcceleration>(),
    Of<PeakWristSpeed>(),   Of<WristSpectralArcLength>(),
    Of<TrackingError>(),
};

// Returns the names of the arms or grippers that have one value each; empty if the metric is a single number.
std::vector<std::string> Owners(MetricKind kind, const MetricsConfig& config) {
  if (kind == MetricKind::kByGripper) return config.grippers;
  std::vector<std::string> arms;
  if (kind == MetricKind::kByArm || kind == MetricKind::kSumByArm) {
    for (const ArmConfig& arm : config.arms) arms.push_back(arm.name);
  }
  return arms;
}

bool IsOneNumber(MetricKind kind) { return kind == MetricKind::kNumber || kind == MetricKind::kCount; }

}  // namespace

ExtendedMetrics::ExtendedMetrics(const MetricsConfig& config) {
  if (!config.extended) return;
  for (const Type& type : kTypes) {
    const size_t first = names_.size();
    for (const std::string name : type.names) {
      const MetricInfo* metric = FindMetric(std::string(kExtended) + name).metric;
      if (!metric) throw std::logic_error(name + " is not in lcmtypes/metric_catalog.cc");
      const std::vector<std::string> owners = Owners(metric->kind, config);
      if (IsOneNumber(metric->kind) || owners.size() == 1) {
        names_.push_back(name);
      } else {
        for (const std::string& owner : owners) names_.push_back(name + "." + owner);
      }
      units_.resize(names_.size(), std::string(metric->unit));
    }
    entries_.push_back({type.make(config), first, names_.size() - first});
  }
  Start();
}

void ExtendedMetrics::Start() {
  for (const Entry& entry : entries_) entry.metric->Start();
}

void ExtendedMetrics::Add(const DerivedSample& sample) {
  for (const Entry& entry : entries_) entry.metric->Add(sample);
}

void ExtendedMetrics::Values(std::vector<double>* values) const {
  values->resize(names_.size());
  for (const Entry& e : entries_) e.metric->Values(std::span(*values).subspan(e.first, e.count));
}

void ExtendedMetrics::FinalValues(int64_t last_tick, std::vector<double>* values) const {
  values->resize(names_.size());
  for (const Entry& e : entries_)
    e.metric->FinalValues(last_tick, std::span(*values).subspan(e.first, e.count));
}

}  // namespace evalbus::metrics
