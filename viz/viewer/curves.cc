#include "viz/viewer/curves.h"

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "lcmtypes/source.h"

namespace evalbus::viz {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The most important curves, which come first. All others follow in the order of episodes.jsonl.
constexpr std::string_view kFirst[] = {"target_distance", "object_pose_error",     "gripper_opening",
                                       "clearance_m",     "cartesian_path_length", "rms_cartesian_jerk"};

double At(const std::vector<double>& values, size_t index) {
  return index < values.size() ? values[index] : kNaN;
}

double Count(int64_t count) { return count == kUnavailableCount ? kNaN : static_cast<double>(count); }

Curve MakeCurve(const std::string& name) {
  const MetricNumber number = FindMetric(name);
  Curve curve;
  curve.name = name;
  curve.label = number.label();
  curve.unit = number.shown_unit();
  curve.scale = number.scale();
  if (number.metric) curve.better = number.metric->better;
  return curve;
}

}  // namespace

CurveTable::CurveTable(const model_info_t& model, const partial_metrics_t& partial) {
  std::vector<Entry> entries;
  for (const MetricInfo& metric : Metrics()) {
    if (!metric.is_extended() && IsTracked(metric, partial.metrics)) {
      AddRoboEval(metric, partial.metrics, &entries);
    }
  }
  AddExtended(partial.extended, &entries);

  Entry opening;
  opening.curve.name = "gripper_opening";
  opening.curve.label = "gripper opening";
  for (size_t k = 0; k < model.gripper.size(); ++k) {
    opening.curve.parts.push_back(model.gripper[k].name);
    opening.rows.push_back(
        [k](const Tick& tick) { return k < tick.opening.size() ? tick.opening[k] : kNaN; });
  }
  entries.push_back(std::move(opening));
  Entry clearance;
  clearance.curve = {.name = "clearance_m",
                     .label = "clearance",
                     .unit = "mm",
                     .better = Better::kHigher,
                     .scale = 1e3,
                     .parts = {""},
                     .is_sparse = true};
  clearance.rows.push_back([](const Tick& tick) { return tick.clearance; });
  entries.push_back(std::move(clearance));

  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::ranges::find(kFirst, a.curve.name) < std::ranges::find(kFirst, b.curve.name);
  });
  for (Entry& entry : entries) {
    if (entry.rows.empty()) continue;
    entry.curve.first_row = rows_.size();
    curves_.push_back(std::move(entry.curve));
    std::ranges::move(entry.rows, std::back_inserter(rows_));
  }
}

void CurveTable::AddRoboEval(const MetricInfo& metric, const metric_values_t& v,
                             std::vector<Entry>* entries) const {
  const std::string name(metric.name);
  const auto one = [&](Row row) {
    Entry& entry = entries->emplace_back(Entry{MakeCurve(name), {}});
    entry.curve.parts = {""};
    entry.rows.push_back(std::move(row));
  };
  const auto each = [&](const std::string& of, const std::vector<std::string>& parts,
                        std::vector<double> metric_values_t::*values) {
    Entry& entry = entries->emplace_back(Entry{MakeCurve(of), {}});
    for (size_t k = 0; k < (v.*values).size(); ++k) {
      const bool is_named = (v.*values).size() > 1 || metric.kind == MetricKind::kByName;
      entry.curve.parts.push_back(is_named && k < parts.size() ? Words(parts[k]) : "");
      entry.rows.push_back([values, k](const Tick& tick) {
        return tick.partial ? At(tick.partial->metrics.*values, k) : kNaN;
      });
    }
  };
  switch (metric.kind) {
    case MetricKind::kSuccess:
    case MetricKind::kByStage:
    case MetricKind::kByObject:
      return;
    case MetricKind::kOfStages:
      if (v.num_stages == 0) return;
      return one(
          [&metric](const Tick& tick) { return tick.partial ? tick.partial->metrics.*metric.number : kNaN; });
    case MetricKind::kOfTwoArms:
      if (v.num_arms != 2) return;
      return one([&metric](const Tick& tick) {
        return tick.partial && tick.partial->metrics.num_samples > 0 ? tick.partial->metrics.*metric.number
                                                                     : kNaN;
      });
    case MetricKind::kNumber:
      if (name == "completion_time") return;
      return one(
          [&metric](const Tick& tick) { return tick.partial ? tick.partial->metrics.*metric.number : kNaN; });
    case MetricKind::kCount:
      return one([&metric](const Tick& tick) {
        return tick.partial ? Count(tick.partial->metrics.*metric.count) : kNaN;
      });
    case MetricKind::kByName:
      return each(name, v.*metric.names, metric.values);
    case MetricKind::kByArm:
    case MetricKind::kSumByArm:
    case MetricKind::kByGripper:
      return each(name, v.arm_name, metric.values);
    case MetricKind::kJerk:
      each("avg_" + name, v.arm_name, metric.jerk->avg);
      return each("rms_" + name, v.arm_name, metric.jerk->rms);
  }
}

void CurveTable::AddExtended(const extended_metrics_t& e, std::vector<Entry>* entries) const {
  const size_t begin = entries->size();
  for (size_t k = 0; k < e.name.size(); ++k) {
    // Splits names such as "mechanical_work_J.left".
    const size_t dot = std::min(e.name[k].find('.'), e.name[k].size());
    const std::string whole = std::string(kExtended) + e.name[k].substr(0, dot);
    auto entry = std::find_if(entries->begin() + static_cast<std::ptrdiff_t>(begin), entries->end(),
                              [&](const Entry& other) { return other.curve.name == whole; });
    if (entry == entries->end()) entry = entries->insert(entry, Entry{MakeCurve(whole), {}});
    entry->curve.parts.push_back(dot < e.name[k].size() ? Words(e.name[k].substr(dot + 1)) : "");
    entry->rows.push_back(
        [k](const Tick& tick) { return tick.partial ? At(tick.partial->extended.value_mixed, k) : kNaN; });
  }
  for (const MetricInfo& metric : Metrics()) {
    if (!metric.counter) continue;
    Entry& entry = entries->emplace_back(Entry{MakeCurve(std::string(metric.name)), {}});
    entry.curve.parts = {""};
    entry.rows.push_back([&metric](const Tick& tick) {
      return tick.partial ? Count(tick.partial->extended.*metric.counter) : kNaN;
    });
  }
}

void CurveTable::Values(const Tick& tick, std::vector<double>* values) const {
  values->resize(rows_.size());
  for (size_t row = 0; row < rows_.size(); ++row) (*values)[row] = rows_[row](tick);
}

}  // namespace evalbus::viz
