#include "cli/results/episode_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/text.h"
#include "cli/results/rescorer.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/metric_catalogue.h"
#include "metrics/episode/result_json.h"
#include "metrics/statistics/run_statistics.h"
#include "models/model_names.h"

namespace evalbus::results {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kSameTouch_us = 100'000;
// Of a value in SI units: what a resting object trembles in simulation is less.
constexpr double kChange = 1e-5;

// What is drawn first; then everything else in the order of episodes.jsonl.
constexpr const char* kFirst[] = {"target_distance", "object_pose_error",     "gripper_opening",
                                  "clearance_m",     "cartesian_path_length", "rms_cartesian_jerk"};

// Collects what is known after each tick.
class Collector {
 public:
  void Add(const metrics::EpisodeScorer& scorer, const state_t& state, const contacts_t& contacts) {
    if (!time_.empty() && Seconds(state.header.sim_time_us) <= time_.back()) *this = Collector();
    time_.push_back(Seconds(state.header.sim_time_us));
    partial_metrics_t partial{};
    scorer.Partial(&partial);
    for (const auto& [name, value] : metrics::FlattenedValues(metrics::ResultJson(partial.metrics)))
      Add(name, value);
    for (const auto& [name, value] :
         metrics::FlattenedValues(metrics::ExtendedJson(partial.extended, partial.metrics))) {
      Add("extended." + name, value);
    }
    opening_.emplace_back();
    for (const gripper_state_t& gripper : state.gripper) opening_.back().push_back(gripper.opening);
    if (contacts.has_clearance) clearance_.emplace_back(time_.back(), contacts.clearance_m);
    for (const contact_t& contact : contacts.contact) {
      const auto pair = std::pair(contact.geom_a, contact.geom_b);
      const auto [last, is_new] = last_touch_us_.emplace(pair, state.header.sim_time_us);
      if (is_new || state.header.sim_time_us - last->second >= kSameTouch_us) {
        touches_.emplace_back(time_.back(), pair);
      }
      last->second = state.header.sim_time_us;
    }
  }

  std::vector<viz::CurveFigure> Figures(const model_info_t& model) const {
    // By the name of the metric, in order of appearance; values in SI units until they are drawn.
    struct Named {
      std::string name;
      viz::CurveFigure curves;
      double scale;
    };
    std::vector<Named> figures;
    const auto figure = [&](const std::string& name, const std::string& label, std::string_view unit,
                            double scale) -> viz::CurveFigure& {
      const auto found = std::ranges::find(figures, name, &Named::name);
      if (found != figures.end()) return found->curves;
      viz::CurveFigure curves{
          .name = label, .unit = std::string(unit), .time = time_, .lines = {}, .events = {}};
      return figures.emplace_back(Named{name, std::move(curves), scale}).curves;
    };
    for (const auto& [name, values] : values_) {
      MetricNumber number = FindMetric(name);
      if (!IsDrawn(number)) continue;
      std::vector<double> padded = values;
      padded.resize(time_.size(), kNaN);
      // "extended.mechanical_work_J.left" is a line of the metric's figure.
      const std::string part = number.metric ? std::exchange(number.of, "") : "";
      const std::string whole = part.empty() ? name : name.substr(0, name.size() - part.size() - 1);
      figure(whole, number.label(), number.shown_unit(), number.scale())
          .lines.push_back({Words(part), std::move(padded)});
    }
    for (int gripper = 0; gripper < model.num_grippers; ++gripper) {
      viz::CurveFigure::Line line{model.gripper[gripper].name, {}};
      for (const std::vector<double>& opening : opening_) line.value.push_back(opening[gripper]);
      figure("gripper_opening", "gripper opening", "", 1).lines.push_back(std::move(line));
    }
    if (clearance_.size() > 1) {
      viz::CurveFigure& clearance = figure("clearance_m", "clearance", "mm", 1e3);
      clearance.time.clear();
      viz::CurveFigure::Line& line = clearance.lines.emplace_back();
      for (const auto& [time, value] : clearance_) {
        clearance.time.push_back(time);
        line.value.push_back(value);
      }
    }

    std::vector<viz::CurveFigure> drawn;
    const auto draw = [&](const Named& named) {
      if (std::ranges::none_of(named.curves.lines, Changes)) return;
      for (viz::CurveFigure::Line& line : drawn.emplace_back(named.curves).lines) {
        for (double& value : line.value) value *= named.scale;
      }
    };
    const auto is_first = [](const std::string& name) {
      return std::find(std::begin(kFirst), std::end(kFirst), name) != std::end(kFirst);
    };
    for (const char* first : kFirst) {
      for (const Named& named : figures) {
        if (named.name == first) draw(named);
      }
    }
    for (const Named& named : figures) {
      if (!is_first(named.name)) draw(named);
    }
    return drawn;
  }

  std::vector<viz::EpisodeEvent> Touches(const model_info_t& model) const {
    const ModelNames names(model);
    std::vector<viz::EpisodeEvent> events;
    for (const auto& [time, pair] : touches_) {
      const bool robot_a = names.IsRobot(pair.first), robot_b = names.IsRobot(pair.second);
      if (robot_a == robot_b ? !robot_a : names.IsObject(robot_a ? pair.second : pair.first)) continue;
      const auto [robot, other] = robot_a ? pair : std::pair(pair.second, pair.first);
      events.push_back({viz::EpisodeEvent::Kind::kCollision, time,
                        fmt::format("{} touches {}", names.GeomName(robot), names.GeomName(other))});
    }
    return events;
  }

 private:
  void Add(const std::string& name, double value) {
    auto found =
        std::find_if(values_.begin(), values_.end(), [&](const auto& entry) { return entry.first == name; });
    if (found == values_.end()) found = values_.insert(values_.end(), {name, {}});
    found->second.resize(time_.size() - 1, kNaN);
    found->second.push_back(value);
  }

  // Sums and means over arms say nothing that the arms' own lines do not; stages are events.
  static bool IsDrawn(const MetricNumber& number) {
    if (!number.metric) return true;
    switch (number.metric->kind) {
      case MetricKind::kSuccess:
      case MetricKind::kByStage:
      case MetricKind::kByObject:
        return false;
      default:
        return number.name != "completion_time" &&
               (number.part == MetricPart::kItself || number.part == MetricPart::kMean ||
                number.part == MetricPart::kRms);
    }
  }

  static bool Changes(const viz::CurveFigure::Line& line) {
    double first = kNaN;
    for (const double value : line.value) {
      if (!std::isfinite(value)) continue;
      if (std::isnan(first)) first = value;
      if (std::abs(value - first) > kChange) return true;
    }
    return false;
  }

  std::vector<double> time_;
  std::vector<std::pair<std::string, std::vector<double>>> values_;
  std::vector<std::vector<double>> opening_;              // by tick, then gripper
  std::vector<std::pair<double, double>> clearance_;      // time and value
  std::map<std::pair<int, int>, int64_t> last_touch_us_;  // by geoms
  std::vector<std::pair<double, std::pair<int, int>>> touches_;
};

std::vector<viz::EpisodeEvent> Events(const episode_summary_t& summary) {
  using Kind = viz::EpisodeEvent::Kind;
  std::vector<viz::EpisodeEvent> events;
  const metric_values_t& metrics = summary.metrics;
  for (int k = 0; k < metrics.num_stages; ++k) {
    if (!metrics.stage_reached[k]) continue;
    events.push_back({Kind::kStage, summary.extended.stage_time_s[k],
                      fmt::format("stage {}: {}", metrics.stage_index[k], metrics.stage_name[k])});
  }
  for (const object_event_t& slip : summary.explanation.slip) {
    events.push_back({Kind::kSlip, slip.time_s, fmt::format("{} slips from {}", slip.object, slip.gripper)});
  }
  std::string end = summary.end_reason;
  if (!summary.failure_reason.empty() && summary.failure_reason != end) end += ": " + summary.failure_reason;
  if (!summary.end_detail.empty()) end += ": " + summary.end_detail;
  events.push_back({Kind::kEnd, Seconds(summary.header.sim_time_us), end});
  return events;
}

}  // namespace

EpisodeTrace TraceEpisode(const std::filesystem::path& log) {
  Collector collector;
  Rescorer rescorer;
  rescorer.OnTick([&](const metrics::EpisodeScorer& scorer, const state_t& state,
                      const contacts_t& contacts) { collector.Add(scorer, state, contacts); });
  const RescoredLog scores = rescorer.Rescore(log);
  if (scores.episodes.empty()) throw InputError(log.string() + ": no episode in this log");
  const RescoredEpisode& episode = scores.episodes.back();

  EpisodeTrace trace{.model = episode.model, .summary = episode.summary, .figures = {}, .events = {}};
  trace.events = Events(episode.summary);
  for (viz::EpisodeEvent& touch : collector.Touches(*episode.model)) trace.events.push_back(std::move(touch));
  std::stable_sort(trace.events.begin(), trace.events.end(),
                   [](const viz::EpisodeEvent& a, const viz::EpisodeEvent& b) {
                     const bool end_a = a.kind == viz::EpisodeEvent::Kind::kEnd,
                                end_b = b.kind == viz::EpisodeEvent::Kind::kEnd;
                     return end_a != end_b ? end_b : a.time < b.time;
                   });
  trace.figures = collector.Figures(*episode.model);
  for (viz::CurveFigure& figure : trace.figures) figure.events = trace.events;
  return trace;
}

}  // namespace evalbus::results
