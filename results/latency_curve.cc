#include "results/latency_curve.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/text.h"
#include "metrics/statistics/exact_tests.h"
#include "policy_bridge/remote/latency.h"
#include "results/conclusion.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

MeasuredMean MeanOf(const metrics::MetricSummary* metric) {
  if (!metric) return {kNoNumber, {kNoNumber, kNoNumber}};
  return {metric->mean, metric->mean_95};
}

// Returns the joint jerk of the robot; for two arms, of both arms together.
const metrics::MetricSummary* FindJointJerk(const metrics::RunSummary& summary) {
  if (const auto* both = summary.Find("overall_rms_joint_jerk")) return both;
  for (const metrics::MetricSummary& metric : summary.metrics) {
    if (metric.name.starts_with("rms_joint_jerk")) return &metric;
  }
  return nullptr;
}

// Formats a value with its interval, for example "12.3 (11.8 to 12.9)". shown: formats a number.
template <class Shown>
std::string Cell(const MeasuredMean& value, const Shown& shown) {
  if (!std::isfinite(value.mean)) return "-";
  if (!std::isfinite(value.interval.lower)) return shown(value.mean);
  return fmt::format("{} ({} to {})", shown(value.mean), shown(value.interval.lower),
                     shown(value.interval.upper));
}

ordered_json Json(const MeasuredMean& value) {
  const auto number = [](double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(); };
  return {{"mean", number(value.mean)},
          {"lower", number(value.interval.lower)},
          {"upper", number(value.interval.upper)}};
}

std::string DelayMs(const DelayPoint& point) { return fmt::format("{:.4g}", point.applied_ms); }

std::string DelayAndRate(const DelayPoint& point) {
  return fmt::format("{} ms ({})", DelayMs(point), Percent(point.success.mean));
}

// Returns the sentence on one execution mode, without a period. points: the points of this mode by delay.
std::string EffectText(const std::vector<const DelayPoint*>& points,
                       const std::vector<const DelayEffect*>& effects,
                       const std::vector<DelayPoint>& all_points) {
  const DelayPoint& first = *points.front();
  double least = 1, most = 0;
  for (const DelayPoint* point : points) {
    if (!std::isfinite(point->success.mean))
      return fmt::format("no conclusion, because no episode with a delay of {} ms has a verdict",
                         DelayMs(*point));
    least = std::min(least, point->success.mean);
    most = std::max(most, point->success.mean);
  }
  if (points.size() == 1)
    return fmt::format("success with a delay of {} ms: {}", DelayMs(first), Percent(first.success.mean));
  std::vector<std::string> lower, higher, unknown;
  for (const DelayEffect* effect : effects) {
    const DelayPoint& point = all_points[effect->point];
    const Judgment judgment = effect->success.judgment();
    if (judgment == Judgment::kNone) unknown.push_back(DelayMs(point));
    if (judgment == Judgment::kWorse) lower.push_back(DelayAndRate(point));
    if (judgment == Judgment::kBetter) higher.push_back(DelayAndRate(point));
  }
  if (lower.empty() && higher.empty()) {
    const std::string rates =
        Percent(least) == Percent(most) ? Percent(least) : PercentagePoints(least) + " to " + Percent(most);
    return fmt::format("success is not shown to depend on the delay: {} with {} to {} ms", rates,
                       DelayMs(first), DelayMs(*points.back()));
  }
  std::vector<std::string> parts;
  if (!lower.empty()) parts.push_back("lower with " + Enumerated(lower));
  if (!higher.empty()) parts.push_back("higher with " + Enumerated(higher));
  return fmt::format(
      "success is {} than with {}{}", fmt::join(parts, " and "), DelayAndRate(first),
      unknown.empty() ? "" : fmt::format("; not shown to differ with {} ms", Enumerated(unknown)));
}

// Returns a sentence on the number of pairs that could show an effect, if none of the effects has so many;
// otherwise empty. p of n pairs is at least 2 / 2^n, and Holm's method multiplies the smallest p by the
// number of effects.
std::string PairsText(const std::vector<DelayEffect>& effects) {
  int pairs = 0;
  for (const DelayEffect& effect : effects) {
    if (effect.success.test != SuccessTest::kMcNemar || !effect.success.paired) return "";
    pairs = std::max(pairs, effect.success.samples.trials);
  }
  int needed = 1;
  while (static_cast<double>(effects.size()) * metrics::McNemarTest(0, needed) >= metrics::kAlpha) ++needed;
  if (pairs >= needed) return "";
  return fmt::format("{} cannot show that success depends on the delay: at least {} are needed.",
                     Plural(pairs, "pair"), needed);
}

}  // namespace

std::vector<DelayEffect> CompareDelays(const std::vector<DelayPoint>& points,
                                       const std::vector<RecordedRun>& runs) {
  const auto alone = [](const RecordedRun& run) {
    return RecordedRuns{
        .folder = run.folder, .name = run.name, .is_suite = false, .runs = {run}, .missing = {}};
  };
  std::vector<DelayEffect> effects;
  for (size_t i = 0; i < points.size(); ++i) {
    size_t reference = i;
    for (size_t k = 0; k < points.size(); ++k) {
      if (points[k].execution == points[i].execution && points[k].delay_ms < points[reference].delay_ms)
        reference = k;
    }
    if (reference != i)
      effects.push_back({i, reference, CompareVerdicts(alone(runs[i]), alone(runs[reference])).success});
  }
  std::vector<SuccessComparison*> family;
  for (DelayEffect& effect : effects) family.push_back(&effect.success);
  AdjustByHolm(family);
  return effects;
}

std::vector<std::string> DelayHeadline(const std::vector<DelayPoint>& points,
                                       const std::vector<DelayEffect>& effects) {
  std::vector<std::string> executions, lines;
  for (const DelayPoint& point : points) {
    if (std::ranges::find(executions, point.execution) == executions.end())
      executions.push_back(point.execution);
  }
  for (const std::string& execution : executions) {
    std::vector<const DelayPoint*> own_points;
    std::vector<const DelayEffect*> own_effects;
    for (const DelayPoint& point : points) {
      if (point.execution == execution) own_points.push_back(&point);
    }
    std::ranges::stable_sort(own_points, {}, &DelayPoint::delay_ms);
    for (const DelayEffect& effect : effects) {
      if (points[effect.point].execution == execution) own_effects.push_back(&effect);
    }
    const std::string text = EffectText(own_points, own_effects, points) + ".";
    lines.push_back(executions.size() > 1 ? execution + ": " + text : Capitalized(text));
  }
  if (effects.empty()) return lines;
  const SuccessComparison& success = effects.front().success;
  std::string test = std::string("Test: ") + TestName(success.test);
  if (success.paired) test += " on equal seeds";
  if (effects.size() > 1)
    test += fmt::format(", p adjusted with Holm's method for {} comparisons", effects.size());
  const auto has_fewer = [](const DelayEffect& effect) { return effect.success.has_fewer_samples(); };
  if (std::ranges::any_of(effects, has_fewer))
    test += "; episodes with equal starts and equal numbers count as one";
  lines.push_back(test + ".");
  if (const std::string pairs = PairsText(effects); !pairs.empty()) lines.push_back(pairs);
  return lines;
}

DelayPoint ReadDelayPoint(const RecordedRun& run) {
  const auto latency = policy::ParseLatency(run.info.value("latency", "none"));
  if (latency.kind != policy::Latency::Kind::kFixed)
    throw InputError(run.name + ": this run has no fixed --latency");
  const double tick_s = 1 / run.info.at("control_hz").get<double>();
  const metrics::RunSummary summary = run.Statistics().Summary(true);
  DelayPoint point{
      .execution = run.info.value("execution", "synchronous"),
      .delay_ms = latency.fixed_s * 1e3,
      .delay_ticks = policy::HeldTicks(latency.fixed_s, tick_s),
      .complete = summary.complete,
      .success = {summary.success_rate, {summary.wilson.lower, summary.wilson.upper}},
      .completion_time_s = MeanOf(summary.Find("completion_time")),
      .joint_jerk_radps3 = MeanOf(FindJointJerk(summary)),
      .stale_action_ratio = MeanOf(summary.Find("extended.stale_action_ratio")).mean,
      .effective_hz = MeanOf(summary.Find("extended.effective_hz")).mean,
      .action_age_s = MeanOf(summary.Find("extended.action_age_s")).mean,
  };
  point.applied_ms = static_cast<double>(point.delay_ticks) * tick_s * 1e3;
  return point;
}

std::string DelayTable(const std::vector<DelayPoint>& points) {
  std::string text = fmt::format("{:<12}  {:>8}  {:>8}  {:<20}  {:<22}  {:<22}  {:>6}  {:>6}  {:>7}\n",
                                 "execution", "delay ms", "episodes", "success %", "time s (successes)",
                                 "joint jerk rad/s³", "stale%", "new/s", "age ms");
  const auto percent = [](double share) { return PercentagePoints(share); };
  const auto decimals = [](int count) { return [count](double value) { return Fixed(value, count); }; };
  const auto number = [](double value, int count) {
    return std::isfinite(value) ? Fixed(value, count) : "-";
  };
  for (const DelayPoint& point : points) {
    text += fmt::format("{:<12}  {:>8.4g}  {:>8}  {:<20}  {:<22}  {:<22}  {:>6}  {:>6}  {:>7}\n",
                        point.execution, point.applied_ms, point.complete, Cell(point.success, percent),
                        Cell(point.completion_time_s, decimals(2)),
                        Cell(point.joint_jerk_radps3, decimals(1)), number(100 * point.stale_action_ratio, 1),
                        number(point.effective_hz, 1), number(1e3 * point.action_age_s, 0));
  }
  return text;
}

ordered_json DelayJson(const std::vector<DelayPoint>& points) {
  ordered_json json = ordered_json::array();
  for (const DelayPoint& point : points) {
    const auto number = [](double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(); };
    json.push_back({{"execution", point.execution},
                    {"delay_ms", point.delay_ms},
                    {"delay_ticks", point.delay_ticks},
                    {"applied_ms", point.applied_ms},
                    {"episodes", point.complete},
                    {"success_rate", Json(point.success)},
                    {"completion_time_s", Json(point.completion_time_s)},
                    {"rms_joint_jerk_radps3", Json(point.joint_jerk_radps3)},
                    {"stale_action_ratio", number(point.stale_action_ratio)},
                    {"effective_hz", number(point.effective_hz)},
                    {"action_age_s", number(point.action_age_s)}});
  }
  return json;
}

std::string DelayCsv(const std::vector<DelayPoint>& points) {
  std::string text;
  const ordered_json rows = DelayJson(points);
  for (const ordered_json& row : rows) {
    const ordered_json flat = row.flatten();
    std::string titles, line;
    for (const auto& [path, value] : flat.items()) {
      std::string title = path.substr(1);
      std::ranges::replace(title, '/', '.');
      titles += (titles.empty() ? "" : ",") + title;
      line += (line.empty() ? "" : ",") + (value.is_string() ? value.get<std::string>()
                                           : value.is_null() ? ""
                                                             : value.dump());
    }
    if (text.empty()) text = titles + "\n";
    text += line + "\n";
  }
  return text;
}

}  // namespace evalbus::results
