#include "viz/watch/score_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/text.h"
#include "lcmtypes/extended_value.h"
#include "lcmtypes/source.h"

namespace evalbus::viz {
namespace {

constexpr std::string_view kFirst[] = {"slip_count",
                                       "env_collision_count",
                                       "self_collision_count",
                                       "extended.min_clearance_m",
                                       "cartesian_path_length",
                                       "cartesian_jerk"};

double Sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

ScoreRow One(const MetricInfo& metric, double value) {
  ScoreRow row;
  row.metric = &metric;
  row.label = metric.label;
  row.whole = value;
  return row;
}

ScoreRow Each(const MetricInfo& metric, std::vector<std::string> of, std::vector<double> values) {
  const bool adds_up = metric.kind == MetricKind::kSumByArm && values.size() > 1;
  ScoreRow row = One(metric, adds_up ? Sum(values) : std::numeric_limits<double>::quiet_NaN());
  row.of = std::move(of);
  row.each = std::move(values);
  return row;
}

void AddJerk(const MetricInfo& metric, const metric_values_t& v, std::vector<ScoreRow>* rows) {
  const auto add = [&](MetricPart part, const std::vector<double>& arms, double overall) {
    MetricNumber number;
    number.metric = &metric;
    number.part = part;
    ScoreRow& row = rows->emplace_back(Each(metric, v.arm_name, arms));
    row.part = part;
    row.label = number.label();
    if (arms.size() > 1) row.whole = overall;
  };
  add(MetricPart::kRms, v.*metric.jerk->rms, v.*metric.jerk->overall_rms);
  add(MetricPart::kMean, v.*metric.jerk->avg, v.*metric.jerk->overall_avg);
}

void AddRoboEval(const MetricInfo& metric, const metric_values_t& v, std::vector<ScoreRow>* rows) {
  switch (metric.kind) {
    case MetricKind::kSuccess:
    case MetricKind::kByStage:
      break;
    case MetricKind::kOfStages:
      if (v.num_stages > 0 && !std::isnan(v.*metric.number)) rows->push_back(One(metric, v.*metric.number));
      break;
    case MetricKind::kOfTwoArms:
      if (v.num_arms == 2) rows->push_back(One(metric, v.*metric.number));
      break;
    case MetricKind::kNumber:
      rows->push_back(One(metric, v.*metric.number));
      break;
    case MetricKind::kCount:
      if (v.*metric.count != kUnavailableCount)
        rows->push_back(One(metric, static_cast<double>(v.*metric.count)));
      break;
    case MetricKind::kByObject:
      // With a single object, the row is omitted, because the count equals the sum.
      for (size_t k = 0; v.object_name.size() > 1 && k < v.object_name.size(); ++k) {
        if (v.slip_count_per_object[k] == kUnavailableCount) continue;
        rows->push_back(One(metric, static_cast<double>(v.slip_count_per_object[k])));
        rows->back().label += ", " + Printable(v.object_name[k]);
      }
      break;
    case MetricKind::kByName:
      for (size_t k = 0; k < (v.*metric.values).size(); ++k) {
        rows->push_back(One(metric, (v.*metric.values)[k]));
        const std::string& name = (v.*metric.names)[k];
        if (!name.empty()) rows->back().label = Printable(name);
      }
      break;
    case MetricKind::kByArm:
    case MetricKind::kSumByArm:
    case MetricKind::kByGripper:
      rows->push_back(Each(metric, v.arm_name, v.*metric.values));
      break;
    case MetricKind::kJerk:
      AddJerk(metric, v, rows);
      break;
  }
}

void AddExtended(const MetricInfo& metric, const extended_metrics_t& e, std::vector<ScoreRow>* rows) {
  if (metric.counter) {
    if (e.*metric.counter != kUnavailableCount) {
      rows->push_back(One(metric, static_cast<double>(e.*metric.counter)));
    }
    return;
  }
  const std::string name(metric.wire_name());
  std::vector<std::string> of;
  std::vector<double> values;
  for (size_t k = 0; k < e.name.size(); ++k) {
    const bool is_part = e.name[k].starts_with(name + ".");
    if (!is_part && e.name[k] != name) continue;
    of.push_back(is_part ? e.name[k].substr(name.size() + 1) : "");
    values.push_back(e.value_mixed[k]);
  }
  if (values.empty()) return;
  const bool is_one = metric.kind == MetricKind::kNumber || metric.kind == MetricKind::kCount;
  rows->push_back(is_one ? One(metric, values[0]) : Each(metric, std::move(of), std::move(values)));
}

}  // namespace

std::vector<ScoreRow> ScoreRows(const metric_values_t& values, const extended_metrics_t& extended) {
  std::vector<ScoreRow> rows;
  for (const MetricInfo& metric : Metrics()) {
    if (metric.is_extended()) {
      AddExtended(metric, extended, &rows);
    } else if (IsTracked(metric, values)) {
      AddRoboEval(metric, values, &rows);
    }
  }
  return rows;
}

std::vector<ScoreRow> FirstRows(const metric_values_t& values, const extended_metrics_t& extended) {
  const std::vector<ScoreRow> rows = ScoreRows(values, extended);
  std::vector<ScoreRow> first;
  for (const std::string_view name : kFirst) {
    // Jerk has two rows; the first row is the root mean square.
    const auto row = std::ranges::find(rows, name, [](const ScoreRow& r) { return r.metric->name; });
    if (row != rows.end()) first.push_back(*row);
  }
  return first;
}

std::vector<StageRow> StageRows(const metric_values_t& values, const extended_metrics_t& extended) {
  std::vector<StageRow> rows;
  for (size_t k = 0; k < values.stage_name.size(); ++k) {
    const double time = k < extended.stage_time_s.size() ? extended.stage_time_s[k] : -1;
    rows.push_back({Printable(values.stage_name[k]), values.stage_reached[k] != 0, time});
  }
  return rows;
}

std::string StageCount(const metric_values_t& values) {
  return fmt::format("{}/{}", std::count(values.stage_reached.begin(), values.stage_reached.end(), 1),
                     values.num_stages);
}

std::string ScoreLine(const metric_values_t& values, const extended_metrics_t& extended) {
  std::string line = "stages " + StageCount(values);
  for (const ScoreRow& row : FirstRows(values, extended)) {
    line += fmt::format("  {} {}", row.label, ShownValue(*row.metric, row.value()));
    if (!row.metric->shown_unit.empty()) line += fmt::format(" {}", row.metric->shown_unit);
  }
  return line;
}

std::string AnytimeRateText(double rate, double lower, double upper) {
  return fmt::format("{} (anytime CI {:.0f} to {:.0f})", Percent(rate), lower * 100, upper * 100);
}

std::string DoneText(const run_summary_t& run, int planned) {
  std::string text = std::to_string(run.num_episodes);
  if (planned > 0) text += fmt::format(" of {}", planned);
  text += run.is_part ? " counted here" : " done";
  const bool is_over = planned > 0 && run.num_episodes >= planned && !run.is_part;
  // The rate is NaN if success cannot be determined.
  const bool has_rate = run.num_complete > 0 && !std::isnan(run.success_rate);
  if (has_rate && is_over) {
    text += fmt::format(", success {} (95 % CI {:.0f} to {:.0f}, Wilson)", Percent(run.success_rate),
                        run.success_rate_wilson_lower * 100, run.success_rate_wilson_upper * 100);
  } else if (has_rate) {
    text += ", success " +
            AnytimeRateText(run.success_rate, run.success_rate_anytime_lower, run.success_rate_anytime_upper);
  }
  const int64_t incomplete = int64_t{run.num_episodes} - run.num_complete;
  if (incomplete > 0) text += fmt::format(", {} incomplete", incomplete);
  return text;
}

std::string SpeedText(double speed) {
  return fmt::format("{:.{}f}", speed, speed >= 99.95 ? 0 : speed >= 9.995 ? 1 : 2);
}

}  // namespace evalbus::viz
