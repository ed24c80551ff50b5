#include "metrics/episode/episode_scorer.h"

#include <algorithm>
#include <limits>
#include <map>

#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"

namespace evalbus::metrics {
namespace {

std::vector<std::string> NamesOf(const std::vector<NamedExpression>& expressions,
                                 const std::vector<uint8_t>& is_known) {
  std::vector<std::string> names;
  for (size_t k = 0; k < expressions.size(); ++k) {
    if (is_known[k]) names.push_back(expressions[k].name);
  }
  return names;
}

MetricsConfig MakeConfig(const ModelNames& names, const TaskDescription& task,
                         const TaskEvaluator& evaluator) {
  const model_info_t& model = names.model();
  MetricsConfig config;
  for (const arm_info_t& arm : model.arm) {
    config.arms.push_back({.name = arm.name,
                           .num_joints = arm.num_joints,
                           .joint_lower = arm.joint_lower_rad,
                           .joint_upper = arm.joint_upper_rad,
                           .joint_torque_limit = arm.joint_torque_limit_Nm});
  }
  for (const gripper_info_t& gripper : model.gripper) config.grippers.push_back(gripper.name);
  config.objects = model.object_name;
  config.control_dt = ControlPeriod(model);

  config.geom_owner.resize(model.num_geoms, GeomOwner::kScene);
  for (int geom = 0; geom < model.num_geoms; ++geom) {
    if (names.IsRobot(geom)) config.geom_owner[geom] = GeomOwner::kRobot;
    if (names.IsObject(geom)) config.geom_owner[geom] = GeomOwner::kObject;
  }

  static_cast<MetricsOptions&>(config) = task.metrics;
  for (size_t k = 0; k < task.stages.size(); ++k) {
    if (!evaluator.knows_stage()[k]) continue;
    config.stages.push_back({.index = task.stages[k].index, .name = task.stages[k].name});
  }
  config.target_distances = NamesOf(task.target_distance, evaluator.knows_distance());
  config.pose_errors = NamesOf(task.pose_error, evaluator.knows_error());
  return config;
}

// Returns pad geoms by finger (a body with pads), then by geom id.
std::vector<std::vector<uint8_t>> Fingers(const model_info_t& model, const gripper_info_t& gripper) {
  std::map<int, std::vector<uint8_t>> fingers;
  for (int geom : gripper.pad_geom) {
    std::vector<uint8_t>& pads = fingers[model.geom_body[geom]];
    pads.resize(model.num_geoms);
    pads[geom] = 1;
  }
  std::vector<std::vector<uint8_t>> result;
  for (auto& [body, pads] : fingers) result.push_back(std::move(pads));
  return result;
}

}  // namespace

EpisodeScorer::EpisodeScorer(const model_info_t& model, const TaskDescription& task)
    : model_(model),
      names_(model_),
      evaluator_(task, names_),
      availability_(model_, evaluator_),
      metrics_(MakeConfig(names_, task, evaluator_)),
      forces_(metrics_.config().control_dt),
      limits_(names_),
      grasps_(metrics_.config()) {
  for (const Stage& stage : task.stages) stage_index_.push_back(stage.index);
  for (const int index : model_.joint_qpos_index) num_coordinates_ = std::max(num_coordinates_, index + 1);
  for (const gripper_info_t& gripper : model_.gripper) fingers_.push_back(Fingers(model_, gripper));
  for (int object = 0; object < model_.num_objects; ++object) {
    objects_.push_back(names_.ObjectGeoms(object));
    object_body_.push_back(names_.Body(model_.object_name[object], {task.file, 0}));
  }
  for (const arm_info_t& arm : model_.arm) final_pose_name_.push_back(arm.name + "_wrist");
  for (int object = 0; object < model_.num_objects; ++object) {
    if (model_.object_is_tracked[object]) final_pose_name_.push_back(model_.object_name[object]);
  }
  final_pose_.reserve(final_pose_name_.size());
  cause_.emplace(names_, object_body_);
  arms_.resize(model_.num_arms);
  opening_.resize(model_.num_grippers);
  holding_.resize(model_.num_grippers * model_.num_objects);
  pinched_.resize(holding_.size());
  Start();
}

void EpisodeScorer::Start() {
  header_ = {};
  started_ = false;
  next_tick_ = missing_ticks_ = unfit_ticks_ = action_clips_ = deadline_misses_ = 0;
  unreachable_poses_ = singular_poses_ = 0;
  decided_.reset();
  final_pose_.clear();
  held_ticks_ = 0;
  holds_ = false;
  evaluator_.Start();
  opening_.assign(opening_.size(), 0);
  holding_.assign(holding_.size(), 0);
  metrics_.Start(opening_, holding_);
  grasps_.Start();
  limits_.Start();
  first_collision_ = {};
  cause_->Start();
}

bool EpisodeScorer::Fits(const state_t& state) const {
  if (state.num_bodies != model_.num_bodies || state.num_arms != model_.num_arms ||
      state.num_grippers != model_.num_grippers || state.num_qpos < num_coordinates_) {
    return false;
  }
  // The sum is 0 only if all numbers are finite, because 0 * x is NaN if x is NaN or infinite.
  double sum = 0;
  for (const body_pose_t& body : state.body) {
    for (double x : body.position_m) sum += 0 * x;
    for (double x : body.quat_wxyz) sum += 0 * x;
  }
  for (double x : state.qpos_mixed) sum += 0 * x;
  return sum == 0;
}

std::span<const contact_t> EpisodeScorer::KnownContacts(const contacts_t& contacts) {
  const std::vector<uint8_t>& unknown = evaluator_.objects().unknown_geoms();
  if (unknown.empty()) return contacts.contact;
  known_contacts_.clear();
  const auto is_unknown = [&](int geom) {
    return geom >= 0 && static_cast<size_t>(geom) < unknown.size() && unknown[geom];
  };
  for (const contact_t& contact : contacts.contact) {
    if (!is_unknown(contact.geom_a) && !is_unknown(contact.geom_b)) known_contacts_.push_back(contact);
  }
  return known_contacts_;
}

void EpisodeScorer::FindHolds(std::span<const contact_t> contacts) {
  for (size_t gripper = 0; gripper < fingers_.size(); ++gripper) {
    for (size_t object = 0; object < objects_.size(); ++object) {
      size_t touching = 0;
      for (const std::vector<uint8_t>& pads : fingers_[gripper]) {
        touching += Touch(contacts, pads, objects_[object]);
      }
      const size_t pair = object * fingers_.size() + gripper;
      holding_[pair] = touching > 0;
      pinched_[pair] = touching > 0 && touching == fingers_[gripper].size();
    }
  }
}

void EpisodeScorer::Tick(const state_t& state, const contacts_t& contacts) {
  header_ = state.header;
  missing_ticks_ += header_.tick - next_tick_;
  next_tick_ = header_.tick + 1;
  if (!decided_) {
    action_clips_ = state.action_clips;
    unreachable_poses_ = state.unreachable_poses;
    singular_poses_ = state.singular_poses;
    deadline_misses_ = state.deadline_misses;
  }
  if (!Fits(state)) {
    ++unfit_ticks_;
    return;
  }
  decided_ ? WatchSuccess(state, contacts) : Score(state, contacts);
}

void EpisodeScorer::WatchSuccess(const state_t& state, const contacts_t& contacts) {
  // Real-time episodes may have ticks after after_success_us. The tolerance of 1 is needed because a source
  // rounds each time to a microsecond.
  if (state.header.sim_time_us - 1 > decided_->sim_time_us + model_.after_success_us) return;
  evaluator_.Evaluate({state, KnownContacts(contacts)}, state.header.tick);
  holds_ = evaluator_.success_holds();
  held_ticks_ += holds_;
}

void EpisodeScorer::KeepPoses(const state_t& state) {
  final_pose_.clear();
  for (const arm_state_t& arm : state.arm) {
    body_pose_t& pose = final_pose_.emplace_back();
    std::ranges::copy(arm.wrist_position_m, pose.position_m);
    std::ranges::copy(arm.wrist_quat_wxyz, pose.quat_wxyz);
  }
  for (size_t object = 0; object < object_body_.size(); ++object) {
    if (model_.object_is_tracked[object]) final_pose_.push_back(state.body[object_body_[object]]);
  }
}

void EpisodeScorer::Score(const state_t& state, const contacts_t& contacts) {
  for (size_t k = 0; k < arms_.size(); ++k) {
    const arm_state_t& arm = state.arm[k];
    const double *p = arm.wrist_position_m, *q = arm.wrist_quat_wxyz;
    arms_[k] = {.joint_position = arm.joint_position_rad,
                .joint_velocity = arm.joint_velocity_radps,
                .wrist_position = {p[0], p[1], p[2]},
                .wrist_quat = {q[0], q[1], q[2], q[3]}};
    if (!model_.has_physics) continue;
    arms_[k].mechanical_work = arm.mechanical_work_J;
    arms_[k].joint_torque_peak = arm.joint_torque_peak_Nm;
    arms_[k].joint_command = arm.joint_command_rad;
  }
  for (size_t k = 0; k < opening_.size(); ++k) opening_[k] = state.gripper[k].opening;
  const std::span<const contact_t> known = KnownContacts(contacts);
  FindHolds(known);
  contacts_.clear();
  for (const contact_t& contact : known) {
    contacts_.push_back({contact.geom_a, contact.geom_b, contact.distance_m});
  }
  const double time = Seconds(header_.sim_time_us);
  Sample sample{.tick = header_.tick,
                .time = time,
                .arm = arms_,
                .gripper_opening = opening_,
                .holding = holding_,
                .pinched = pinched_,
                .contacts = contacts_};
  if (contacts.has_clearance) sample.clearance = contacts.clearance_m;
  if (model_.has_physics) sample.forces = forces_.Read(state);

  // Tick 0, or the first tick that arrived, is the reference for slips. Tick 0 does not count as a sample.
  if (!started_) {
    started_ = true;
    metrics_.Start(opening_, holding_);
    if (header_.tick == 0) {
      evaluator_.Evaluate({state, known}, 0);
      cause_->Add(sample, state, known, evaluator_);
    }
  }
  if (header_.tick > 0) {
    if (!metrics_.Step(sample)) return;
    const std::span<const SceneContact> collisions = metrics_.scene_contacts();
    KeepPoses(state);
    grasps_.Add(header_.tick, pinched_);
    limits_.Add(state);
    if (first_collision_.tick == 0 && !collisions.empty()) first_collision_ = {header_.tick, collisions[0]};
    evaluator_.Evaluate({state, known}, header_.tick);
    cause_->Add(sample, state, known, evaluator_);
  }
  for (size_t k = 0; k < stage_index_.size(); ++k) {
    if (evaluator_.stage_reached()[k]) metrics_.SetStage(stage_index_[k], true);
  }
  for (size_t k = 0, of_metrics = 0; k < evaluator_.target_distance().size(); ++k) {
    if (evaluator_.knows_distance()[k])
      metrics_.SetTargetDistance(of_metrics++, evaluator_.target_distance()[k]);
  }
  for (size_t k = 0, of_metrics = 0; k < evaluator_.pose_error().size(); ++k) {
    if (evaluator_.knows_error()[k]) metrics_.SetPoseError(of_metrics++, evaluator_.pose_error()[k]);
  }
  metrics_.SetSuccess(evaluator_.verdict() == Verdict::kSuccess);
  if (evaluator_.verdict() != Verdict::kUndecided) decided_ = header_;
  holds_ = evaluator_.success_holds();
}

void EpisodeScorer::EndAt(int64_t last_tick) {
  if (last_tick < next_tick_) return;
  missing_ticks_ += last_tick + 1 - next_tick_;
  next_tick_ = last_tick + 1;
}

int8_t EpisodeScorer::verdict() const {
  const Verdict verdict = evaluator_.verdict();
  return verdict == Verdict::kSuccess   ? partial_metrics_t::SUCCESS
         : verdict == Verdict::kFailure ? partial_metrics_t::FAILURE
                                        : partial_metrics_t::UNDECIDED;
}

std::optional<int64_t> EpisodeScorer::verdict_time_us() const {
  return decided_ ? std::optional(decided_->sim_time_us) : std::nullopt;
}

void EpisodeScorer::FillExtended(bool is_over, extended_metrics_t* extended) const {
  extended_metrics_t& e = *extended;
  e.missing_ticks = missing_ticks_;
  e.refused_samples = refused_samples();
  e.action_clips = action_clips_;
  e.unreachable_poses = unreachable_poses_;
  e.singular_poses = singular_poses_;
  e.deadline_misses = deadline_misses_;
  const std::vector<StageState>& stages = metrics_.stages().stages();
  e.num_stages = static_cast<int32_t>(stages.size());
  e.stage_time_s.resize(stages.size());
  for (size_t k = 0; k < stages.size(); ++k) e.stage_time_s[k] = stages[k].reached_time;
  const ExtendedMetrics& metrics = metrics_.extended();
  e.name = metrics.names();
  e.unit = metrics.units();
  const int64_t last_tick = decided_ ? decided_->tick : next_tick_ - 1;
  is_over ? metrics.FinalValues(last_tick, &e.value_mixed) : metrics.Values(&e.value_mixed);
  const auto add = [&e](const char* name, const char* unit, double value) {
    e.name.emplace_back(name);
    e.unit.emplace_back(unit);
    e.value_mixed.push_back(value);
  };
  if (limits_.has_limits())
    add("limit_violations", "count", static_cast<double>(limits_.violations().size()));
  if (limits_.has_grip_limits()) {
    add("squeeze_excess_N", "N", limits_.largest_squeeze());
    add("squeeze_time_s", "s", TickTime(limits_.squeeze_ticks(), metrics_.config().control_dt));
  }
  if (model_.after_success_us > 0) {
    const bool succeeded = evaluator_.verdict() == Verdict::kSuccess;
    const double held = TickTime(held_ticks_, metrics_.config().control_dt);
    add("success_once", "1", succeeded);
    add("success_end", "1", succeeded && holds_);
    add("success_held_s", "s", succeeded ? held : std::numeric_limits<double>::quiet_NaN());
  }
  e.num_values = static_cast<int32_t>(e.name.size());
  availability_.MaskUnavailable(extended);
}

void EpisodeScorer::Partial(partial_metrics_t* partial) const {
  partial->header = header_;
  partial->verdict = verdict();
  metrics_.Values(&partial->metrics);
  availability_.MaskUnavailable(&partial->metrics);
  FillExtended(false, &partial->extended);
}

void EpisodeScorer::Criteria(criteria_t* criteria) const {
  criteria->header = header_;
  evaluator_.Criteria(criteria);
}

episode_summary_t EpisodeScorer::Summary(const episode_begin_t& begin, const episode_end_t& end) const {
  episode_summary_t summary{};
  summary.header = end.header;
  summary.seed = begin.seed;
  summary.verdict = verdict();
  summary.end_reason = end.end_reason;
  summary.end_detail = end.detail;
  const EpisodeOutcome outcome{.names = names_,
                               .slips = metrics_.slips(),
                               .verdict = evaluator_.verdict(),
                               .can_succeed = evaluator_.can_succeed(),
                               .out_of_bounds = evaluator_.out_of_bounds(),
                               .end_reason = end.end_reason,
                               .end_detail = end.detail,
                               .last_tick = decided_ ? decided_->tick : header_.tick,
                               .conditions = evaluator_.ExplainVerdict()};
  CauseEnd cause_end = MakeCauseEnd(outcome);
  cause_end.knows_stages = evaluator_.knows_all_stages();
  const FoundCause found = cause_->Find(cause_end);
  summary.cause = found.cause;
  summary.failure_reason = found.failure_reason;
  summary.complete = missing_ticks_ == 0 && refused_samples() == 0 &&
                     end.end_reason != end_reason::kAborted && end.end_reason != end_reason::kServerError &&
                     summary.failure_reason != kUnconfirmed;
  metrics_.Values(&summary.metrics);
  availability_.MaskUnavailable(&summary.metrics);
  FillExtended(true, &summary.extended);
  if (!final_pose_.empty()) summary.final_pose_name = final_pose_name_;
  summary.final_pose = final_pose_;
  summary.num_final_poses = static_cast<int32_t>(final_pose_.size());
  summary.explanation =
      Explain(outcome, cause_end, metrics_, first_collision_, grasps_.grasps(), limits_.violations());
  return summary;
}

}  // namespace evalbus::metrics
