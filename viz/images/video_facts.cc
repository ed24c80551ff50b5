#include "viz/images/video_facts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/text.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"
#include "models/model_names.h"
#include "viz/images/overlay.h"

namespace evalbus::viz {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Time for which instantaneous events stay marked in the image, s.
constexpr double kCollisionShown = 0.5, kSlipShown = 1.0;
// Metrics of distance, effort and smoothness.
constexpr const char* kCurves[] = {"cartesian_path_length", "extended.mechanical_work_J", "cartesian_jerk"};

void AddCurves(const EpisodeMessages& episode, VideoFacts* facts) {
  for (const partial_metrics_t& partial : episode.partials) {
    facts->time_s.push_back(Seconds(partial.header.sim_time_us));
    const std::vector<ScoreRow> rows = ScoreRows(partial.metrics, partial.extended);
    for (const char* name : kCurves) {
      // Jerk has two rows; the first row is the root mean square.
      const auto row = std::ranges::find(rows, name, [](const ScoreRow& r) { return r.metric->name; });
      if (row == rows.end()) continue;
      auto curve = std::ranges::find(facts->curves, row->label, &VideoCurve::label);
      if (curve == facts->curves.end()) {
        VideoCurve made;
        made.label = row->label;
        made.unit = row->metric->shown_unit;
        made.of = row->of;
        made.value.resize(std::max<size_t>(1, row->each.size()));
        curve = facts->curves.insert(curve, std::move(made));
      }
      for (size_t line = 0; line < curve->value.size(); ++line) {
        const double value = line < row->each.size() ? row->each[line] : row->value();
        std::vector<double>& values = curve->value[line];
        values.resize(facts->time_s.size() - 1, kNaN);
        values.push_back(value * row->metric->scale);
      }
    }
  }
  for (VideoCurve& curve : facts->curves) {
    for (std::vector<double>& values : curve.value) {
      values.resize(facts->time_s.size(), kNaN);
      for (const double value : values) {
        if (!std::isfinite(value)) continue;
        curve.lowest = std::min(curve.lowest, value);
        curve.highest = std::max(curve.highest, value);
      }
    }
  }
}

void AddMarks(const EpisodeMessages& episode, VideoFacts* facts) {
  using Kind = VideoMark::Kind;
  for (const StageRow& stage : facts->stages) {
    if (stage.reached && stage.time >= 0) facts->marks.push_back({Kind::kStage, stage.time, 0});
  }
  const bool has_explanation = episode.summary.has_value();
  if (has_explanation) {
    for (const object_event_t& grasp : episode.summary->explanation.grasp) {
      facts->marks.push_back({Kind::kGrasp, grasp.time_s, grasp.duration_s});
    }
    for (const object_event_t& slip : episode.summary->explanation.slip) {
      facts->marks.push_back({Kind::kSlip, slip.time_s, 0});
    }
  }
  int64_t slips = 0, collisions = 0;
  for (const partial_metrics_t& partial : episode.partials) {
    const metric_values_t& metrics = partial.metrics;
    const auto is_known = [](int64_t count) { return count != kUnavailableCount; };
    const int64_t scene = metrics.env_collision_count, self = metrics.self_collision_count;
    facts->counts_slips = metrics.tracks_slippage && is_known(metrics.slip_count);
    facts->counts_collisions = metrics.tracks_collisions && (is_known(scene) || is_known(self));
    const double time = Seconds(partial.header.sim_time_us);
    for (; slips < metrics.slip_count; ++slips) {
      if (!has_explanation) facts->marks.push_back({Kind::kSlip, time, 0});
    }
    const int64_t counted = (is_known(scene) ? scene : 0) + (is_known(self) ? self : 0);
    for (; collisions < counted; ++collisions) facts->marks.push_back({Kind::kCollision, time, 0});
  }
  std::ranges::stable_sort(facts->marks, {}, &VideoMark::time_s);
}

PlaceMark At(VideoMark::Kind kind, const double position_m[3]) {
  return {kind, {position_m[0], position_m[1], position_m[2]}};
}

// Steps through the contacts of an episode in order of time.
class Touches {
 public:
  Touches(const EpisodeMessages& episode, bool counts_collisions)
      : episode_(episode), names_(*episode.model), counts_collisions_(counts_collisions) {}

  // Returns the marks to show at this time. Must be called with ascending times.
  std::vector<PlaceMark> Until(int64_t time_us) {
    while (next_ < episode_.contacts.size() && episode_.contacts[next_].header.sim_time_us <= time_us) {
      Add(episode_.contacts[next_++]);
    }
    std::vector<PlaceMark> marks;
    for (const auto& [object, point] : wanted_) marks.push_back(At(VideoMark::Kind::kGrasp, point.data()));
    std::erase_if(collisions_, [&](const auto& entry) {
      return Seconds(time_us - entry.second.last_us) > kCollisionShown && !entry.second.is_touching;
    });
    for (const auto& [pair, touch] : collisions_) {
      marks.push_back(At(VideoMark::Kind::kCollision, touch.point.data()));
    }
    if (episode_.summary) {
      for (const object_event_t& slip : episode_.summary->explanation.slip) {
        const double since = Seconds(time_us) - slip.time_s;
        if (since < 0 || since > kSlipShown) continue;
        const auto place = slipped_.find({slip.object, slip.tick});
        if (place != slipped_.end()) marks.push_back(At(VideoMark::Kind::kSlip, place->second.data()));
      }
    }
    return marks;
  }

 private:
  using Place = std::array<double, 3>;
  struct Collision {
    Place point;
    int64_t last_us;
    bool is_touching;
  };

  void Add(const contacts_t& contacts) {
    wanted_.clear();
    for (auto& [pair, touch] : collisions_) touch.is_touching = false;
    const int num_geoms = episode_.model->num_geoms;
    for (const contact_t& contact : contacts.contact) {
      const int a = contact.geom_a, b = contact.geom_b;
      if (std::min(a, b) < 0 || std::max(a, b) >= num_geoms) continue;
      const bool robot_a = names_.IsRobot(a), robot_b = names_.IsRobot(b);
      if (!robot_a && !robot_b) continue;
      const Place point{contact.position_m[0], contact.position_m[1], contact.position_m[2]};
      const int other = robot_a ? b : a;
      if (robot_a != robot_b && names_.IsObject(other)) {
        const int entity = episode_.model->body_entity[episode_.model->geom_body[other]];
        wanted_.emplace_back(entity, point);
        held_[entity] = point;
      } else if (counts_collisions_) {
        collisions_[{a, b}] = {point, contacts.header.sim_time_us, true};
      }
    }
    if (!episode_.summary) return;
    // A slip is marked at the place where the object was last held.
    for (const object_event_t& slip : episode_.summary->explanation.slip) {
      if (slip.tick != contacts.header.tick) continue;
      const auto& objects = episode_.model->object_name;
      const auto object = std::ranges::find(objects, slip.object);
      if (object == objects.end()) continue;
      const auto held = held_.find(episode_.model->object_entity[object - objects.begin()]);
      if (held != held_.end()) slipped_[{slip.object, slip.tick}] = held->second;
    }
  }

  const EpisodeMessages& episode_;
  const ModelNames names_;
  const bool counts_collisions_;
  size_t next_ = 0;
  std::vector<std::pair<int, Place>> wanted_;            // entity and place, at the last tick only
  std::map<int, Place> held_;                            // key: entity
  std::map<std::pair<int, int>, Collision> collisions_;  // key: pair of geoms
  std::map<std::pair<std::string, int64_t>, Place> slipped_;
};

bool HasCause(const EpisodeMessages& episode) {
  return episode.summary && !episode.summary->cause.text.empty();
}

// Returns an explanation of the outcome: the cause or, in logs without a cause, the deciding condition and
// the end reason.
std::string Reason(const EpisodeMessages& episode) {
  if (HasCause(episode)) return Printable(episode.summary->cause.text);
  std::string text;
  const auto add = [&text](const std::string& part) {
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  };
  if (episode.summary) {
    add(episode.summary->end_detail);
    for (const condition_t& condition : episode.summary->explanation.condition) add(condition.text);
  } else if (episode.end) {
    add(episode.end->detail);
  }
  return Words(Printable(text));
}

}  // namespace

VideoFacts FactsOf(const EpisodeMessages& episode, const std::vector<size_t>& schedule,
                   const std::string& policy) {
  VideoFacts facts;
  facts.task = Printable(episode.model->task + "/" + episode.model->variation);
  facts.maker = MakerText(policy, episode.model->robot);
  facts.episode = episode.number();
  facts.duration_s = Seconds(episode.states.back().header.sim_time_us);
  AddCurves(episode, &facts);
  const metric_values_t* metrics = nullptr;
  const extended_metrics_t* extended = nullptr;
  if (episode.summary) {
    metrics = &episode.summary->metrics;
    extended = &episode.summary->extended;
  } else if (!episode.partials.empty()) {
    metrics = &episode.partials.back().metrics;
    extended = &episode.partials.back().extended;
  }
  if (metrics) {
    facts.stages = StageRows(*metrics, *extended);
    for (StageRow& stage : facts.stages) stage.name = Words(stage.name);
    for (const ScoreRow& row : FirstRows(*metrics, *extended)) {
      facts.numbers.emplace_back(row.label, ShownWithUnit(*row.metric, row.value()));
    }
  }
  AddMarks(episode, &facts);
  facts.places.resize(schedule.size());
  if (!episode.contacts.empty()) {
    Touches touches(episode, facts.counts_collisions);
    for (size_t n = 0; n < schedule.size(); ++n) {
      facts.places[n] = touches.Until(episode.states[schedule[n]].header.sim_time_us);
    }
  }
  facts.outcome = Printable(episode.outcome());
  facts.success = facts.outcome == end_reason::kSuccess;
  facts.outcome_s = HasCause(episode) ? episode.summary->cause.time_s : facts.duration_s;
  facts.reason = Reason(episode);
  return facts;
}

}  // namespace evalbus::viz
