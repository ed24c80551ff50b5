#include "viz/viewer/episode_track.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/text.h"
#include "bus/message.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/violation_text.h"
#include "models/task_description.h"
#include "viz/viewer/condition_tree.h"

namespace evalbus::viz {
namespace {

using Json = nlohmann::ordered_json;
using Kind = TrackEvent::Kind;

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
// A condition's state is 0 (false), 1 (true) or kNotKnown (not evaluated).
constexpr uint8_t kNotKnown = 2;
constexpr double kUnit = 32767;
constexpr int64_t kSameTouch_us = 100'000;
// If scores are missing, ticks that are at least this far behind the newest STATE are output without scores.
constexpr int64_t kMaxUnscoredTicks = 50;

int16_t Fraction(double value) {
  return static_cast<int16_t>(std::lround(std::clamp(value, -1.0, 1.0) * kUnit));
}

bool IsFinite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

const char* BetterWord(Better better) { return better == Better::kHigher ? "higher" : "lower"; }

}  // namespace

const char* Word(TrackEvent::Kind kind) {
  constexpr const char* kWords[] = {"stage",          "slip",  "grasp",     "release", "collision",
                                    "self_collision", "limit", "no_return", "cause",   "end"};
  return kWords[static_cast<size_t>(kind)];
}

EpisodeTrack::EpisodeTrack(std::shared_ptr<const model_info_t> model, const header_t& episode, About about)
    : model_(std::move(model)),
      names_(*model_),
      episode_(episode),
      about_(std::move(about)),
      grasps_(names_) {
  std::erase_if(about_.bodies, [&](int body) { return body < 0 || body >= model_->num_bodies; });
}

EpisodeTrack::Tick* EpisodeTrack::At(const header_t& header) {
  if (!IsOurs(header) || !IsPlausible(header)) return nullptr;
  if (header.tick >= kMaxTicks) {
    is_cut_ = true;
    return nullptr;
  }
  const auto tick = static_cast<size_t>(header.tick);
  if (tick >= ticks_.size()) ticks_.resize(tick + 1);
  if (!ticks_[tick]) ticks_[tick] = std::make_unique<Tick>();
  return ticks_[tick].get();
}

const EpisodeTrack::Tick* EpisodeTrack::Find(int64_t tick) const {
  return tick >= 0 && tick < static_cast<int64_t>(ticks_.size()) ? ticks_[static_cast<size_t>(tick)].get()
                                                                 : nullptr;
}

void EpisodeTrack::Fill(Tick* tick, const partial_metrics_t* partial) {
  std::vector<double> values;
  curves_.Values({.partial = partial, .opening = tick->opening, .clearance = tick->clearance}, &values);
  tick->values.resize(values.size(), std::numeric_limits<double>::quiet_NaN());
  for (size_t row = 0; row < values.size(); ++row) {
    if (std::isfinite(values[row])) tick->values[row] = values[row];
  }
}

void EpisodeTrack::Receive(const episode_begin_t& begin, Json appearance) {
  if (!IsOurs(begin.header) || begin_) return;
  begin_ = begin;
  appearance_ = std::move(appearance);
  ++layout_;
}

void EpisodeTrack::Receive(const state_t& state) {
  if (state.num_bodies != model_->num_bodies || state.num_grippers != model_->num_grippers) return;
  const bool is_finite = std::ranges::all_of(about_.bodies, [&](int body) {
    const body_pose_t& pose = state.body[static_cast<size_t>(body)];
    // Positions beyond the range of the fixed-point format count as invalid.
    return IsFinite(pose.position_m) && IsFinite(pose.quat_wxyz) &&
           std::ranges::all_of(pose.position_m, [](double x) { return std::abs(x) < 4e4; });
  });
  Tick* tick = is_finite ? At(state.header) : nullptr;
  if (!tick || tick->has_state) return;
  tick->has_state = true;
  const Tick* before = Find(state.header.tick - 1);
  for (size_t i = 0; i < about_.bodies.size(); ++i) {
    const body_pose_t& pose = state.body[static_cast<size_t>(about_.bodies[i])];
    auto& position = tick->position.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      position[k] = static_cast<int32_t>(std::lround(pose.position_m[k] / kPositionStep));
    }
    auto& quat = tick->quat.emplace_back();
    double along = 0;
    for (size_t k = 0; k < 4; ++k) {
      if (before && before->has_state) along += pose.quat_wxyz[k] * before->quat[i][k];
    }
    for (size_t k = 0; k < 4; ++k) quat[k] = Fraction(along < 0 ? -pose.quat_wxyz[k] : pose.quat_wxyz[k]);
  }
  for (const gripper_state_t& gripper : state.gripper) tick->opening.push_back(gripper.opening);
  Fill(tick, nullptr);
}

void EpisodeTrack::Receive(const contacts_t& contacts) {
  const bool is_right = std::ranges::all_of(contacts.contact, [&](const contact_t& contact) {
    return std::min(contact.geom_a, contact.geom_b) >= 0 &&
           std::max(contact.geom_a, contact.geom_b) < model_->num_geoms && IsFinite(contact.position_m) &&
           IsFinite(contact.normal);
  });
  Tick* tick = is_right ? At(contacts.header) : nullptr;
  if (!tick || tick->has_contacts) return;
  tick->has_contacts = true;
  for (const contact_t& contact : contacts.contact) {
    Contact& kept = tick->contacts.emplace_back();
    kept.a = static_cast<uint16_t>(contact.geom_a);
    kept.b = static_cast<uint16_t>(contact.geom_b);
    for (size_t k = 0; k < 3; ++k) {
      kept.position[k] = static_cast<float>(contact.position_m[k]);
      kept.normal[k] = Fraction(contact.normal[k]);
    }
    kept.depth = static_cast<float>(-contact.distance_m);
  }
  if (contacts.has_clearance) {
    tick->clearance = contacts.clearance_m;
    for (size_t k = 0; k < 3; ++k) {
      tick->clearance_points[k] = static_cast<float>(contacts.clearance_robot_point_m[k]);
      tick->clearance_points[3 + k] = static_cast<float>(contacts.clearance_scene_point_m[k]);
    }
    tick->clearance_geoms = {static_cast<int16_t>(contacts.clearance_robot_geom),
                             static_cast<int16_t>(contacts.clearance_scene_geom)};
  }
  tick->pinched = grasps_.Pinched(contacts);
  WatchTouches(contacts);
  Fill(tick, nullptr);
}

void EpisodeTrack::WatchTouches(const contacts_t& contacts) {
  if (contacts.header.tick <= last_contacts_) return;
  last_contacts_ = contacts.header.tick;
  const int64_t now = contacts.header.sim_time_us;
  for (const contact_t& contact : contacts.contact) {
    const auto [last, is_new] = last_touch_us_.emplace(std::pair(contact.geom_a, contact.geom_b), now);
    const bool is_another = is_new || now - last->second >= kSameTouch_us;
    last->second = now;
    if (!is_another) continue;
    const bool robot_a = names_.IsRobot(contact.geom_a), robot_b = names_.IsRobot(contact.geom_b);
    const int robot = robot_a ? contact.geom_a : contact.geom_b;
    const int other = robot_a ? contact.geom_b : contact.geom_a;
    if (robot_a == robot_b ? !robot_a : names_.IsObject(other)) continue;
    touches_.push_back(
        MakeEvent(robot_b && robot_a ? Kind::kSelfCollision : Kind::kCollision, contacts.header.tick,
                  fmt::format("{} touches {}", names_.GeomName(robot), names_.GeomName(other))));
  }
}

void EpisodeTrack::Receive(const partial_metrics_t& partial) {
  Tick* tick = At(partial.header);
  if (!tick) return;
  if (curves_.curves().empty()) {
    curves_ = CurveTable(*model_, partial);
    ++layout_;
    for (auto& other : ticks_) {
      if (other) Fill(other.get(), nullptr);
    }
  }
  Fill(tick, &partial);
  if (partial_ && partial.header.tick <= partial_->header.tick) return;
  if (partial_) {
    WatchScores(*partial_, partial);
    grasps_.Add(*partial_, partial, tick->pinched);
  }
  partial_ = partial;
}

// Only EPISODE_SUMMARY names the gripper of each slip. Until it arrives, slips are detected by increases of
// their count.
void EpisodeTrack::WatchScores(const partial_metrics_t& before, const partial_metrics_t& now) {
  const metric_values_t &a = before.metrics, &b = now.metrics;
  for (size_t k = 0; k < std::min(a.slip_count_per_object.size(), b.slip_count_per_object.size()); ++k) {
    // There is one event per slip, because two grippers may lose an object at the same tick.
    for (int64_t count = a.slip_count_per_object[k]; count < b.slip_count_per_object[k]; ++count) {
      TrackEvent event = MakeEvent(Kind::kSlip, now.header.tick, b.object_name[k] + " slips");
      event.object = b.object_name[k];
      slips_.push_back(std::move(event));
    }
  }
}

void EpisodeTrack::Receive(const criteria_t& criteria) {
  if (!IsOurs(criteria.header) || !IsPlausible(criteria.header)) return;
  if (!criteria_) {
    criteria_ = criteria;
    criteria_joined_ = CriteriaTrees();
    ++layout_;
  }
  if (criteria.num_success != criteria_->num_success || criteria.num_failure != criteria_->num_failure)
    return;
  CriteriaAt at{.tick = criteria.header.tick, .value = {}, .holds = {}};
  for (const auto* list : {&criteria.success, &criteria.failure}) {
    for (const condition_t& condition : *list) {
      at.value.push_back(condition.has_value ? static_cast<float>(condition.value_mixed) : kNoNumber);
      // The reset state (tick 0) is not evaluated.
      at.holds.push_back(at.tick == 0 ? kNotKnown : static_cast<uint8_t>(condition.holds != 0));
    }
  }
  const auto place = std::ranges::lower_bound(criteria_at_, at.tick, {}, &CriteriaAt::tick);
  if (place != criteria_at_.end() && place->tick == at.tick) return;
  criteria_at_.insert(place, std::move(at));
}

void EpisodeTrack::Receive(const episode_end_t& end) {
  if (!IsOurs(end.header) || end_ || !IsPlausible(end.header)) return;
  end_ = end;
}

void EpisodeTrack::Receive(const episode_summary_t& summary) {
  if (!IsOurs(summary.header) || summary_ || !IsPlausible(summary.header)) return;
  summary_ = summary;
  ++layout_;
}

void EpisodeTrack::Receive(const image_t& image) {
  if (!IsOurs(image.header) || !IsPlausible(image.header) || image.header.tick >= kMaxTicks ||
      image.view.encoding != "jpeg" || image.data.empty()) {
    return;
  }
  auto camera = std::ranges::find(cameras_, image.view.camera);
  if (camera == cameras_.end()) {
    if (cameras_.size() > std::numeric_limits<uint8_t>::max()) return;
    camera = cameras_.insert(cameras_.end(), image.view.camera);
    num_images_.push_back(0);
    ++layout_;
  }
  const auto index = static_cast<size_t>(camera - cameras_.begin());
  const int64_t number = num_images_[index]++;
  if (number % image_stride_ != 0) return;
  images_.push_back({index, number, image.header.tick, ticks(), {image.data.begin(), image.data.end()}});
  image_bytes_ += image.data.size();
  while (image_bytes_ > about_.image_bytes && images_.size() > cameras_.size()) {
    image_stride_ *= 2;
    std::erase_if(images_, [&](const Image& kept) { return kept.number % image_stride_ != 0; });
    image_bytes_ = 0;
    for (const Image& kept : images_) image_bytes_ += kept.jpeg.size();
  }
}

int64_t EpisodeTrack::ticks() const {
  const auto all = static_cast<int64_t>(ticks_.size());
  if (is_over()) return all;
  // The CRITERIA of a tick arrives before the PARTIAL of the next tick.
  const int64_t scored = partial_ ? std::min(partial_->header.tick, all) : 0;
  return std::max<int64_t>({scored, all - kMaxUnscoredTicks, 0});
}

double EpisodeTrack::Value(size_t row, int64_t tick) const {
  const Tick* found = Find(tick);
  return found && row < found->values.size() ? found->values[row] : std::numeric_limits<double>::quiet_NaN();
}

double EpisodeTrack::Time(int64_t tick) const { return TickTime(tick, ControlPeriod(*model_)); }

TrackEvent EpisodeTrack::MakeEvent(Kind kind, int64_t tick, std::string text) const {
  TrackEvent event;
  event.kind = kind;
  event.tick = tick;
  event.time = Time(tick);
  event.text = std::move(text);
  return event;
}

void EpisodeTrack::AddGrasp(const std::string& gripper, const std::string& object, int64_t first_tick,
                            int64_t last_tick, int64_t scored_tick, std::vector<TrackEvent>* events) const {
  const bool is_over = last_tick < scored_tick;
  const auto add = [&](Kind kind, int64_t tick, const char* verb) {
    TrackEvent& added =
        events->emplace_back(MakeEvent(kind, tick, fmt::format("{} {} {}", gripper, verb, object)));
    added.gripper = gripper;
    added.object = object;
    if (kind == Kind::kGrasp && is_over)
      added.duration = TickTime(last_tick + 1 - first_tick, ControlPeriod(*model_));
  };
  add(Kind::kGrasp, first_tick, "grasps");
  if (is_over) add(Kind::kRelease, last_tick + 1, "no longer grips");
}

std::vector<TrackEvent> EpisodeTrack::Events() const {
  std::vector<TrackEvent> events;
  const metric_values_t* metrics = summary_ ? &summary_->metrics : partial_ ? &partial_->metrics : nullptr;
  const extended_metrics_t* extended = summary_   ? &summary_->extended
                                       : partial_ ? &partial_->extended
                                                  : nullptr;
  const double dt = ControlPeriod(*model_);
  for (size_t k = 0; metrics && k < metrics->stage_reached.size() && k < extended->stage_time_s.size(); ++k) {
    if (!metrics->stage_reached[k] || !std::isfinite(extended->stage_time_s[k])) continue;
    events.push_back(
        MakeEvent(Kind::kStage, std::llround(extended->stage_time_s[k] / dt),
                  fmt::format("stage {}: {}", metrics->stage_index[k], Words(metrics->stage_name[k]))));
  }
  // The metrics use no ticks after the verdict, but an episode may continue after it.
  const int64_t scored_tick = metrics ? std::llround(metrics->completion_time_s / dt) : 0;
  if (summary_) {
    for (const object_event_t& slip : summary_->explanation.slip) {
      TrackEvent& added = events.emplace_back(
          MakeEvent(Kind::kSlip, slip.tick, fmt::format("{} slips from {}", slip.object, slip.gripper)));
      added.gripper = slip.gripper;
      added.object = slip.object;
    }
    for (const object_event_t& grasp : summary_->explanation.grasp) {
      const int64_t last_tick = grasp.tick + std::llround(grasp.duration_s / dt) - 1;
      AddGrasp(grasp.gripper, grasp.object, grasp.tick, last_tick, scored_tick, &events);
    }
    for (const limit_violation_t& violation : summary_->explanation.violation) {
      events.push_back(MakeEvent(Kind::kLimit, violation.tick, ViolationText(violation)));
    }
  } else {
    events.insert(events.end(), slips_.begin(), slips_.end());
    for (const GraspWatch::Grasp& grasp : grasps_.grasps()) {
      AddGrasp(model_->gripper[static_cast<size_t>(grasp.gripper)].name,
               model_->object_name[static_cast<size_t>(grasp.object)], grasp.first_tick, grasp.last_tick,
               scored_tick, &events);
    }
  }
  if (summary_ && !summary_->failure_reason.empty() && !summary_->cause.text.empty()) {
    events.push_back(MakeEvent(Kind::kCause, summary_->cause.tick, summary_->cause.text));
  }
  if (no_return_) events.push_back(MakeEvent(Kind::kNoReturn, no_return_->first, no_return_->second));
  events.insert(events.end(), touches_.begin(), touches_.end());
  std::stable_sort(events.begin(), events.end(),
                   [](const TrackEvent& a, const TrackEvent& b) { return a.tick < b.tick; });
  if (summary_) {
    std::string end = end_reason::Text(summary_->end_reason);
    const std::string reason = end_reason::Text(summary_->failure_reason);
    // The reason has its own time, which is the time of the cause.
    if (!reason.empty() && reason != end && summary_->cause.text.empty()) end += ": " + reason;
    if (!summary_->end_detail.empty()) end += ": " + summary_->end_detail;
    events.push_back(MakeEvent(Kind::kEnd, summary_->header.tick, end));
  } else if (end_) {
    events.push_back(MakeEvent(Kind::kEnd, end_->header.tick, end_reason::Text(end_->end_reason)));
  }
  return events;
}

Json EpisodeTrack::CriteriaJson() const {
  Json list = Json::array();
  if (!criteria_) return list;
  size_t row = 0;
  const auto add = [&](const condition_t& condition, bool is_failure) {
    Json json = {{"predicate", condition.predicate},
                 {"subject", condition.subject},
                 {"other", condition.other},
                 {"unit", condition.unit},
                 {"comparison", condition.comparison}};
    if (condition.has_value) {
      json["threshold"] = NumberOrNull(condition.threshold_mixed);
      json["first_row"] = row++;
    }
    json["text_first"] = condition.text;
    if (is_failure) json["failure"] = true;
    list.push_back(std::move(json));
  };
  for (const condition_t& condition : criteria_->success) add(condition, false);
  for (const condition_t& condition : criteria_->failure) add(condition, true);
  return list;
}

Json EpisodeTrack::CriteriaTrees() const {
  try {
    TaskDescription task = ParseTask(model_->task_yaml, model_->task_file, false);
    task.Apply(model_->variation);
    const size_t successes = criteria_->success.size();
    return {{"success", ConditionTree(task.success, 0, successes)},
            {"failure", ConditionTree(task.failure, successes, criteria_->failure.size())}};
  } catch (const InputError&) {
    return nullptr;  // the page then shows the conditions as a flat list
  }
}

void EpisodeTrack::AddHead(Json* head_in) const {
  Json& head = *head_in;
  head["run"] = about_.run;
  head["episode"] = episode_.episode;
  head["attempt"] = episode_.attempt;
}

// Adds the members of the head that "ticks" blocks also contain.
void EpisodeTrack::AddChanging(Json* head_in) const {
  Json& head = *head_in;
  head["ticks"] = ticks();
  if (is_cut_) head["is_cut"] = true;
  head["is_over"] = is_over();
  for (const char* key : {"end_reason", "failure_reason", "end_detail", "explanation", "cause_time_s",
                          "cause_text", "success", "complete"}) {
    head[key] = nullptr;
  }
  if (end_) head["end_reason"] = end_->end_reason;
  if (summary_) {
    head["end_reason"] = summary_->end_reason;
    head["failure_reason"] = summary_->failure_reason;
    if (!summary_->end_detail.empty()) head["end_detail"] = summary_->end_detail;
    head["explanation"] = summary_->explanation.text;
    if (!summary_->cause.text.empty()) {
      head["cause_time_s"] = summary_->cause.time_s;
      head["cause_text"] = summary_->cause.text;
    }
    if (summary_->failure_reason != end_reason::kNotJudged) {
      head["success"] = summary_->metrics.success != 0;
    }
    head["complete"] = summary_->complete != 0;
  }
  Json& stages = head["stages"] = Json::array();
  const metric_values_t* metrics = summary_ ? &summary_->metrics : partial_ ? &partial_->metrics : nullptr;
  const extended_metrics_t* extended = summary_   ? &summary_->extended
                                       : partial_ ? &partial_->extended
                                                  : nullptr;
  for (size_t k = 0; metrics && k < metrics->stage_name.size(); ++k) {
    const double time = k < extended->stage_time_s.size() ? extended->stage_time_s[k] : -1;
    const bool is_reached = metrics->stage_reached[k] && std::isfinite(time) && time >= 0;
    stages.push_back({{"name", metrics->stage_name[k]},
                      {"index", metrics->stage_index[k]},
                      {"tick", is_reached ? Json(std::llround(time / ControlPeriod(*model_))) : Json()}});
  }
  Json& events = head["events"] = Json::array();
  for (const TrackEvent& event : Events()) {
    Json& json =
        events.emplace_back(Json{{"tick", event.tick}, {"kind", Word(event.kind)}, {"text", event.text}});
    if (!event.gripper.empty()) json["gripper"] = event.gripper;
    if (!event.object.empty()) json["object"] = event.object;
    if (event.duration > 0) json["duration_s"] = event.duration;
  }
}

void EpisodeTrack::AddArrays(int64_t from, BlockWriter* block) const {
  const int64_t to = ticks();
  const auto n = static_cast<size_t>(std::max<int64_t>(0, to - from));
  const size_t bodies = about_.bodies.size();
  // State that is shown at each tick: the tick's own state or, if it is missing, the previous state or, if
  // there is none, the first state.
  std::vector<const Tick*> shown(n, nullptr);
  std::vector<uint32_t> missing;
  const Tick* last = nullptr;
  for (int64_t tick = from - 1; !last && tick >= 0; --tick) {
    if (const Tick* found = Find(tick); found && found->has_state) last = found;
  }
  for (int64_t tick = from; !last && tick < to; ++tick) {
    if (const Tick* found = Find(tick); found && found->has_state) last = found;
  }
  for (size_t i = 0; i < n; ++i) {
    const Tick* found = Find(from + static_cast<int64_t>(i));
    if (found && found->has_state) {
      last = found;
    } else {
      missing.push_back(static_cast<uint32_t>(from + static_cast<int64_t>(i)));
    }
    shown[i] = last;
  }
  if (last) {
    std::vector<int32_t> position(bodies * 3 * n);
    std::vector<int16_t> quat(bodies * 4 * n);
    for (size_t i = 0; i < n; ++i) {
      for (size_t body = 0; body < bodies; ++body) {
        for (size_t k = 0; k < 3; ++k) position[(body * 3 + k) * n + i] = shown[i]->position[body][k];
        for (size_t k = 0; k < 4; ++k) quat[(body * 4 + k) * n + i] = shown[i]->quat[body][k];
      }
    }
    block->AddDeltas("position_m", {bodies, 3, n}, std::move(position))["scale"] = kPositionStep;
    block->AddDeltas("quat", {bodies, 4, n}, std::move(quat))["scale"] = 1 / kUnit;
  }

  std::vector<float> curves(curves_.rows() * n, kNoNumber);
  for (const Curve& curve : curves_.curves()) {
    for (size_t row = curve.first_row; row < curve.first_row + curve.parts.size(); ++row) {
      for (size_t i = 0; i < n; ++i) {
        curves[row * n + i] = static_cast<float>(Value(row, from + static_cast<int64_t>(i)) * curve.scale);
      }
    }
  }
  block->Add("curves", {curves_.rows(), n}, curves);

  if (criteria_) {
    const size_t count = criteria_->success.size() + criteria_->failure.size();
    std::vector<size_t> with_value;
    for (size_t k = 0; k < count; ++k) {
      const bool is_failure = k >= criteria_->success.size();
      const condition_t& condition =
          is_failure ? criteria_->failure[k - criteria_->success.size()] : criteria_->success[k];
      if (condition.has_value) with_value.push_back(k);
    }
    std::vector<float> value(with_value.size() * n, kNoNumber);
    std::vector<uint8_t> holds(count * n, kNotKnown);
    size_t next = 0;
    for (size_t i = 0; i < n; ++i) {
      while (next < criteria_at_.size() && criteria_at_[next].tick <= from + static_cast<int64_t>(i)) ++next;
      if (next == 0) continue;
      const CriteriaAt& at = criteria_at_[next - 1];
      for (size_t row = 0; row < with_value.size(); ++row) value[row * n + i] = at.value[with_value[row]];
      for (size_t k = 0; k < count; ++k) holds[k * n + i] = at.holds[k];
    }
    block->Add("criteria", {with_value.size(), n}, value);
    block->Add("criteria_hold", {count, n}, holds);
  }

  std::vector<float> points(6 * n, kNoNumber);
  std::vector<int16_t> clearance_geoms(2 * n, -1);
  std::vector<uint32_t> contact_from;
  std::vector<const Contact*> contacts;
  for (size_t i = 0; i < n; ++i) {
    contact_from.push_back(static_cast<uint32_t>(contacts.size()));
    const Tick* tick = Find(from + static_cast<int64_t>(i));
    if (!tick) continue;
    for (const Contact& contact : tick->contacts) contacts.push_back(&contact);
    if (!std::isfinite(tick->clearance)) continue;
    for (size_t k = 0; k < 6; ++k) points[k * n + i] = tick->clearance_points[k];
    for (size_t k = 0; k < 2; ++k) clearance_geoms[k * n + i] = tick->clearance_geoms[k];
  }
  contact_from.push_back(static_cast<uint32_t>(contacts.size()));
  block->Add("clearance_points_m", {6, n}, points);
  block->Add("clearance_geoms", {2, n}, clearance_geoms);
  const size_t c = contacts.size();
  std::vector<uint16_t> geoms(2 * c);
  std::vector<float> position(3 * c), depth(c);
  std::vector<int16_t> normal(3 * c);
  for (size_t i = 0; i < c; ++i) {
    geoms[i] = contacts[i]->a;
    geoms[c + i] = contacts[i]->b;
    depth[i] = contacts[i]->depth;
    for (size_t k = 0; k < 3; ++k) position[k * c + i] = contacts[i]->position[k];
    for (size_t k = 0; k < 3; ++k) normal[k * c + i] = contacts[i]->normal[k];
  }
  block->Add("contact_from", {n + 1}, contact_from);
  block->Add("contact_geoms", {2, c}, geoms);
  block->Add("contact_position_m", {3, c}, position);
  block->Add("contact_normal", {3, c}, normal)["scale"] = 1 / kUnit;
  block->Add("contact_depth_m", {c}, depth);
  block->Add("missing", {missing.size()}, missing);
  if (!cameras_.empty()) AddImages(from, block);
}

void EpisodeTrack::AddImages(int64_t from, BlockWriter* block) const {
  std::vector<uint8_t> camera, jpeg;
  std::vector<uint32_t> tick, begins;
  for (const Image& image : images_) {
    if (image.known_ticks < from) continue;
    camera.push_back(static_cast<uint8_t>(image.camera));
    tick.push_back(static_cast<uint32_t>(image.tick));
    begins.push_back(static_cast<uint32_t>(jpeg.size()));
    jpeg.insert(jpeg.end(), image.jpeg.begin(), image.jpeg.end());
  }
  begins.push_back(static_cast<uint32_t>(jpeg.size()));
  block->Add("image_camera", {camera.size()}, camera);
  block->Add("image_tick", {tick.size()}, tick);
  block->Add("image_from", {begins.size()}, begins);
  block->Add("image_jpeg", {jpeg.size()}, jpeg);
}

std::string EpisodeTrack::EpisodeBlock() const {
  BlockWriter block("episode");
  Json& head = block.head();
  AddHead(&head);
  head["seed"] = begin_ ? Json(begin_->seed) : summary_ ? Json(summary_->seed) : Json();
  head["scene"] = about_.scene.empty() ? Json() : Json(about_.scene);
  head["task"] = model_->task;
  head["variation"] = model_->variation;
  head["policy"] = about_.policy;
  head["clock"] = model_->clock;
  head["tick_s"] = ControlPeriod(*model_);
  head["time_limit_s"] = Seconds(model_->time_limit_us);
  AddChanging(&head);
  head["appearance"] = appearance_;
  Json& parameters = head["parameters"] = Json::array();
  for (size_t k = 0; begin_ && k < begin_->parameter_name.size(); ++k) {
    parameters.push_back({begin_->parameter_name[k], NumberOrNull(begin_->parameter_value_mixed[k])});
  }
  head["bodies"] = about_.bodies;
  head["arms"] = ArmNames(*model_);
  Json& grippers = head["grippers"] = Json::array();
  for (const gripper_info_t& gripper : model_->gripper) grippers.push_back(gripper.name);
  head["objects"] = model_->object_name;
  head["image_cameras"] = cameras_;
  Json& curves = head["curves"] = Json::array();
  for (const Curve& curve : curves_.curves()) {
    curves.push_back({{"name", curve.name},
                      {"label", curve.label},
                      {"unit", curve.unit},
                      {"parts", curve.parts},
                      {"better", curve.better == Better::kNeither ? Json() : Json(BetterWord(curve.better))},
                      {"first_row", curve.first_row}});
    if (curve.is_sparse) curves.back()["sparse"] = true;
  }
  head["criteria"] = CriteriaJson();
  if (criteria_) head["criteria_joined"] = criteria_joined_;
  AddArrays(0, &block);
  return block.Bytes();
}

std::string EpisodeTrack::TicksBlock(int64_t from) const {
  BlockWriter block("ticks");
  AddHead(&block.head());
  block.head()["from"] = from;
  AddChanging(&block.head());
  AddArrays(from, &block);
  return block.Bytes();
}

}  // namespace evalbus::viz
