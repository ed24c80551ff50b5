#include "metrics/episode/metric_availability.h"

#include <limits>
#include <string_view>

#include "lcmtypes/metric_catalog.h"

namespace evalbus::metrics {

enum class MetricAvailability::Need {
  kPhysics,                // quantities that only a physics engine provides (model_info_t.has_physics)
  kObjects,                // the poses of all manipulated objects
  kForbiddenContactGeoms,  // poses of objects with parts that must not be touched, which count as scene
  kStages,                 // every stage of the task can be judged
  kVerdict,                // success and failure can be judged
};

struct MetricAvailability::Row {
  std::string_view metric;
  Need need;
};

// Metrics that are not listed need joint positions only. Velocities computed as differences of positions are
// sufficient.
const MetricAvailability::Row MetricAvailability::kNeeds[] = {
    {"subtask_progress", Need::kStages},
    {"slip_count", Need::kObjects},
    {"env_collision_count", Need::kForbiddenContactGeoms},
    {"extended.contact_time_s", Need::kForbiddenContactGeoms},
    {"extended.command_log_dimensionless_jerk", Need::kPhysics},
    {"extended.env_collision_events", Need::kForbiddenContactGeoms},
    {"extended.first_touch_s", Need::kObjects},
    {"extended.grasp_count", Need::kObjects},
    {"extended.grasp_time_s", Need::kObjects},
    {"extended.longest_grasp_s", Need::kObjects},
    {"extended.regrasp_count", Need::kObjects},
    {"extended.grip_force_mean_N", Need::kPhysics},
    {"extended.grip_force_peak_N", Need::kPhysics},
    {"extended.limit_violations", Need::kPhysics},
    {"extended.mechanical_work_J", Need::kPhysics},
    {"extended.min_clearance_m", Need::kForbiddenContactGeoms},
    {"extended.min_clearance_time_s", Need::kForbiddenContactGeoms},
    {"extended.min_joint_torque_margin", Need::kPhysics},
    {"extended.p95_object_force_N", Need::kPhysics},
    {"extended.p95_scene_force_N", Need::kPhysics},
    {"extended.p95_self_force_N", Need::kPhysics},
    {"extended.peak_object_force_N", Need::kPhysics},
    {"extended.peak_scene_force_N", Need::kPhysics},
    {"extended.peak_self_force_N", Need::kPhysics},
    {"extended.peak_penetration_m", Need::kObjects},
    {"extended.peak_touch_energy_J", Need::kPhysics},
    {"extended.squeeze_excess_N", Need::kPhysics},
    {"extended.squeeze_time_s", Need::kPhysics},
    {"extended.unwanted_impulse_Ns", Need::kPhysics},
    {"extended.tracking_error_rad", Need::kPhysics},
    {"extended.success_once", Need::kVerdict},
    {"extended.success_end", Need::kVerdict},
    {"extended.success_held_s", Need::kVerdict},
    {"extended.action_clips", Need::kPhysics},
    {"extended.deadline_misses", Need::kPhysics},
    {"extended.unreachable_poses", Need::kPhysics},
    {"extended.singular_poses", Need::kPhysics},
};

MetricAvailability::MetricAvailability(const model_info_t& model, const TaskEvaluator& evaluator)
    : has_physics_(model.has_physics != 0),
      all_objects_(evaluator.objects().all()),
      forbidden_contact_geoms_(!evaluator.objects().lacks_forbidden_contact_geoms()),
      stages_(evaluator.knows_all_stages()),
      verdict_(evaluator.can_succeed()),
      is_tracked_(model.object_is_tracked.begin(), model.object_is_tracked.end()) {
  everything_ = has_physics_ && all_objects_ && forbidden_contact_geoms_ && stages_ && verdict_;
}

bool MetricAvailability::Has(Need need) const {
  switch (need) {
    case Need::kPhysics:
      return has_physics_;
    case Need::kObjects:
      return all_objects_;
    case Need::kForbiddenContactGeoms:
      return forbidden_contact_geoms_;
    case Need::kStages:
      return stages_;
    case Need::kVerdict:
      break;
  }
  return verdict_;
}

void MetricAvailability::MaskUnavailable(metric_values_t* values) const {
  if (everything_) return;
  for (const Row& row : kNeeds) {
    if (Has(row.need)) continue;
    const MetricInfo& metric = *FindMetric(std::string(row.metric)).metric;
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
    const std::string_view metric = name.substr(0, name.find('.'));
    for (const Row& row : kNeeds) {
      if (row.metric.starts_with(kExtended) && row.metric.substr(kExtended.size()) == metric)
        return Has(row.need);
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
  for (const Row& row : kNeeds) {
    const MetricInfo& metric = *FindMetric(std::string(row.metric)).metric;
    if (metric.counter && !Has(row.need)) e.*metric.counter = kUnavailableCount;
  }
}

}  // namespace evalbus::metrics
