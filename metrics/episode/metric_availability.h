// Determines which values are available for a run from an external source. Metrics whose inputs the source
// does not provide are omitted, not reported as zero (docs/metrics.md, "What a source must know"). The
// metric catalog lists the input that each metric needs. Pure.
#pragma once

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "lcmtypes/metric_catalog.h"
#include "lcmtypes/source.h"
#include "metrics/task/task_evaluator.h"

namespace evalbus::metrics {

class MetricAvailability {
 public:
  MetricAvailability(const model_info_t& model, const TaskEvaluator& evaluator);

  void MaskUnavailable(metric_values_t* values) const;
  void MaskUnavailable(extended_metrics_t* values) const;

 private:
  bool has_physics_, all_objects_, forbidden_contact_geoms_, stages_, verdict_;
  bool everything_;
  std::vector<uint8_t> is_tracked_;

  bool Has(MetricInput input) const;
};

}  // namespace evalbus::metrics
