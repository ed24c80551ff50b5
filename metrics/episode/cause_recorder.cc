#include "metrics/episode/cause_recorder.h"

#include <algorithm>
#include <utility>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {
namespace {

CauseConfig MakeCauseConfig(const model_info_t& model) {
  CauseConfig config{.dt = ControlPeriod(model),
                     .objects = model.object_name,
                     .entities = model.entity_name,
                     .object_entity = {model.object_entity.begin(), model.object_entity.end()},
                     .bodies = model.body_name,
                     .body_entity = {model.body_entity.begin(), model.body_entity.end()}};
  for (const arm_info_t& arm : model.arm) {
    config.joint_arm.insert(config.joint_arm.end(), arm.num_joints, static_cast<int>(config.arms.size()));
    config.arms.push_back(arm.name);
    config.arm_entity.push_back(arm.entity);
  }
  for (const gripper_info_t& gripper : model.gripper) {
    config.grippers.push_back(gripper.name);
    config.gripper_arm.push_back(gripper.arm);
  }
  return config;
}

// Returns the index of the arm of each geom; -1: not part of an arm.
std::vector<int> ArmsOfGeoms(const model_info_t& model) {
  std::vector<int> arms(model.num_geoms, -1);
  for (int geom = 0; geom < model.num_geoms; ++geom) {
    const int entity = model.body_entity[model.geom_body[geom]];
    for (int arm = 0; arm < model.num_arms; ++arm) {
      if (model.arm[arm].entity == entity) arms[geom] = arm;
    }
  }
  return arms;
}

}  // namespace

CauseRecorder::CauseRecorder(const ModelNames& names, std::vector<int> object_body)
    : names_(names),
      object_body_(std::move(object_body)),
      geom_arm_(ArmsOfGeoms(names.model())),
      finder_(MakeCauseConfig(names.model())) {}

void CauseRecorder::SetContacts(std::span<const contact_t> contacts) {
  const model_info_t& model = names_.model();
  const auto exists = [&](int geom) { return geom >= 0 && geom < model.num_geoms; };
  contacts_.clear();
  for (const contact_t& contact : contacts) {
    for (const auto& [robot, other] :
         {std::pair(contact.geom_a, contact.geom_b), std::pair(contact.geom_b, contact.geom_a)}) {
      if (!exists(robot) || !exists(other) || geom_arm_[robot] < 0) continue;
      // Contacts of an arm with itself, and with parts of the robot that are not arms, do not count.
      if (names_.IsRobot(other) && (geom_arm_[other] < 0 || geom_arm_[other] == geom_arm_[robot])) continue;
      const ArmContact pair{geom_arm_[robot], model.body_entity[model.geom_body[other]]};
      if (std::ranges::find(contacts_, pair) == contacts_.end()) contacts_.push_back(pair);
    }
  }
}

void CauseRecorder::Add(const Sample& sample, const state_t& state, std::span<const contact_t> contacts,
                        const TaskEvaluator& evaluator) {
  object_.resize(object_body_.size());
  for (size_t k = 0; k < object_body_.size(); ++k) {
    const double* p = state.body[object_body_[k]].position_m;
    object_[k] = {p[0], p[1], p[2]};
  }
  wrist_.clear();
  joints_.clear();
  commands_.clear();
  torque_.clear();
  for (size_t k = 0; k < sample.arm.size(); ++k) {
    const ArmSample& arm = sample.arm[k];
    wrist_.push_back(arm.wrist_position);
    joints_.insert(joints_.end(), arm.joint_position.begin(), arm.joint_position.end());
    commands_.insert(commands_.end(), arm.joint_command.begin(), arm.joint_command.end());
    if (!names_.model().has_physics) continue;
    const std::vector<double>& torque = state.arm[k].joint_torque_Nm;
    torque_.insert(torque_.end(), torque.begin(), torque.end());
  }
  closing_.clear();
  for (size_t k = 0; names_.model().has_physics && k < sample.gripper_opening.size(); ++k) {
    closing_.push_back(state.gripper[k].closing_command);
  }
  SetContacts(contacts);
  if (sample.tick > 0) evaluator.ConditionsByStage(&conditions_);
  finder_.Add({.tick = sample.tick,
               .opening = sample.gripper_opening,
               .closing = closing_,
               .touching = sample.holding,
               .pinched = sample.pinched,
               .object = object_,
               .wrist = wrist_,
               .body = state.body,
               .joints = joints_,
               .commands = commands_,
               .torque = torque_,
               .contacts = contacts_},
              evaluator.stage_reached(), conditions_);
}

}  // namespace evalbus::metrics
