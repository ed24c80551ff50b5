#include "metrics/episode/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/text.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/violation_text.h"

namespace evalbus::metrics {
namespace {

// Number of slips that the text describes. It only states how many more there are. The data list all slips.
constexpr size_t kSlipsInText = 2;

// Collisions by geom name; geoms without a name share the name of their body.
std::map<std::string, int64_t> CollisionsByName(const ModelNames& names, const RolloutMetrics& metrics) {
  std::map<std::string, int64_t> collisions;
  for (const auto& [geom, count] : metrics.env_collisions().counts()) {
    collisions[names.GeomName(static_cast<int>(geom))] += count;
  }
  for (const auto& [pair, count] : metrics.self_collisions().counts()) {
    const int a = static_cast<int>(pair >> 32), b = static_cast<int>(pair & 0xffffffff);
    collisions[names.GeomName(a) + " + " + names.GeomName(b)] += count;
  }
  return collisions;
}

object_event_t Event(const model_info_t& model, int object, int gripper, int64_t tick, double dt) {
  object_event_t event{};
  event.object = model.object_name[object];
  event.gripper = model.gripper[gripper].name;
  event.tick = tick;
  event.time_s = TickTime(tick, dt);
  return event;
}

// Returns a text that states how the episode ended: by a verdict, by the end of the data, by the time limit,
// or for another reason.
std::string HowItEnded(const EpisodeOutcome& outcome, const CauseEnd& end) {
  if (end.by == CauseEnd::By::kSuccess) return end_reason::kSuccess;
  if (end.by == CauseEnd::By::kFailure) return end_reason::kFailure;
  return end.by == CauseEnd::By::kTime ? outcome.end_reason : end.reason;
}

std::string Text(const explanation_t& e, const std::string& reason, double time, bool has_stages) {
  std::string text = fmt::format("{} at {:.2f} s", end_reason::Text(reason), time);
  if (reason == end_reason::kServerError) {
    text += " (invalid: the policy's server failed, so there is no result for the policy)";
  }
  if (reason == end_reason::kNotJudged) {
    text += " (success cannot be determined: poses of objects are missing)";
  }
  // Several operands of an `any` may wait for the same condition.
  std::set<std::string> listed;
  for (const condition_t& condition : e.condition) {
    if (!listed.insert(condition.text).second) continue;
    text += (listed.size() == 1 ? ": " : ", ") + condition.text;
  }
  if (e.last_stage_index > 0) {
    text += fmt::format("; highest stage {} ({}) at {:.2f} s", e.last_stage_index, e.last_stage_name,
                        e.last_stage_time_s);
  } else if (has_stages) {
    text += "; no stage reached";
  }
  if (e.has_first_collision) {
    text += fmt::format("; first collision at {:.2f} s, {} with {}", e.first_collision_time_s,
                        e.first_collision_robot_geom, e.first_collision_scene_geom);
  }
  for (size_t k = 0; k < std::min(e.slip.size(), kSlipsInText); ++k) {
    text += fmt::format("; {} slipped from {} at {:.2f} s", e.slip[k].object, e.slip[k].gripper,
                        e.slip[k].time_s);
  }
  if (e.slip.size() > kSlipsInText) text += " and " + Plural(e.slip.size() - kSlipsInText, "more slip");
  if (!e.violation.empty()) {
    const limit_violation_t& first = e.violation[0];
    text += fmt::format("; {} of force limits, first at {:.2f} s, {}",
                        Plural(e.violation.size(), "violation"), first.time_s, ViolationText(first));
  }
  return text;
}

}  // namespace

explanation_t Explain(const EpisodeOutcome& outcome, const CauseEnd& end, const RolloutMetrics& metrics,
                      const FirstCollision& collision, const std::vector<GraspInterval>& grasps,
                      const std::vector<limit_violation_t>& violations) {
  const ModelNames& names = outcome.names;
  const model_info_t& model = names.model();
  const double dt = metrics.config().control_dt;
  explanation_t e{};
  for (const StageState& stage : metrics.stages().stages()) {
    if (!stage.reached) continue;
    e.last_stage_index = stage.index;
    e.last_stage_name = stage.name;
    e.last_stage_time_s = stage.reached_time;
  }
  e.condition = outcome.conditions;
  e.num_conditions = static_cast<int32_t>(e.condition.size());
  if (collision.tick > 0) {
    e.has_first_collision = true;
    e.first_collision_robot_geom = names.GeomName(collision.contact.robot_geom);
    e.first_collision_scene_geom = names.GeomName(collision.contact.scene_geom);
    e.first_collision_tick = collision.tick;
    e.first_collision_time_s = TickTime(collision.tick, dt);
  }
  for (const auto& [name, count] : CollisionsByName(names, metrics)) {
    e.collision_name.push_back(name);
    e.collision_count.push_back(count);
  }
  e.num_collision_names = static_cast<int32_t>(e.collision_name.size());
  for (const Slip& slip : outcome.slips) {
    e.slip.push_back(Event(model, slip.object, slip.gripper, slip.tick, dt));
  }
  e.num_slips = static_cast<int32_t>(e.slip.size());
  for (const GraspInterval& grasp : grasps) {
    e.grasp.push_back(Event(model, grasp.object, grasp.gripper, grasp.first_tick, dt));
    e.grasp.back().duration_s = TickTime(grasp.ticks(), dt);
  }
  e.num_grasps = static_cast<int32_t>(e.grasp.size());
  e.violation = violations;
  e.num_violations = static_cast<int32_t>(violations.size());
  e.text = Text(e, HowItEnded(outcome, end), metrics.time(), !metrics.stages().stages().empty());
  return e;
}

}  // namespace evalbus::metrics
