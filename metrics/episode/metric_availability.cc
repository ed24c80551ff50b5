#include "metrics/episode/metric_availability.h"

#include <limits>
#include <string_view>

namespace evalbus::metrics {

MetricAvailability::MetricAvailability(const model_info_t& model, const TaskEvaluator& evaluator)
    : has_physics_(model.has_physics != 0),
      all_objects_(evaluator.objects().all()),
      forbidden_contact_geoms_(!evaluator.objects().lacks_forbidden_contact_geoms()),
      stages_(evaluator.knows_all_stages()),
      verdict_(evaluator.can_succeed()),
      is_tracked_(model.object_is_tracked.begin(), model.object_is_tracked.end()) {
  everything_ = has_physics_ && all_objects_ && forbidden_contact_geoms_ && stages_ && verdict_;
}

bool MetricAvailability::Has(MetricInput input) const {
  return input == MetricInput::kPhysics                 ? has_physics_
         : input == MetricInput::kObjects               ? all_objects_
         : input == MetricInput::kForbiddenContactGeoms ? forbidden_contact_geoms_
         : input == MetricInput::kStages                ? stages_
         : input == MetricInput::kVerdict               ? verdict_
                                                        : true;
}

void MetricAvailability::MaskUnavailable(metric_values_t* values) const {
  if (everything_) return;
  for (const MetricInfo& metric : Metrics()) {
    if (Has(metric.input)) continue;
    if (metric.number) values->*metric.number = std::numeric_limits<double>::quiet_NaN();
    if (metric.count) values->*metric.count = kUnavailableCount;
  }
  for (size_t k = 0; k < is_tracked_.size(); ++k) {
    if (!is_tracked_[k]) values->slip_count_per_object[k] = kUnavailableCount;
  }
}

void MetricAvailability::MaskUnavailable(extended_metrics_t* values) const {
  if (everything_) return;
  extended_metrics_t& e = *values;
  const auto is_known = [this](std::string_view name) {
    const std::string_view whole = name.substr(0, name.find('.'));
    for (const MetricInfo& metric : Metrics()) {
      if (metric.is_extended() && metric.wire_name() == whole) return Has(metric.input);
    }
    return true;
  };
  size_t kept = 0;
  for (size_t k = 0; k < e.name.size(); ++k) {
    if (!is_known(e.name[k])) continue;
    e.name[kept] = e.name[k];
    e.unit[kept] = e.unit[k];
    e.value_mixed[kept++] = e.value_mixed[k];
  }
  e.name.resize(kept);
  e.unit.resize(kept);
  e.value_mixed.resize(kept);
  e.num_values = static_cast<int32_t>(kept);
  for (const MetricInfo& metric : Metrics()) {
    if (metric.counter && !Has(metric.input)) e.*metric.counter = kUnavailableCount;
  }
}

}  // namespace evalbus::metrics
