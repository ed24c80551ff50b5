#include "policy_bridge/experts/expert.h"

#include <functional>
#include <map>

#include "base/errors.h"
#include "policy_bridge/experts/cube_handover.h"
#include "policy_bridge/experts/lift_by_handles.h"
#include "policy_bridge/experts/pack_box.h"
#include "policy_bridge/experts/rotate_valve.h"
#include "policy_bridge/experts/single_book.h"
#include "policy_bridge/experts/stack_two_blocks.h"

namespace evalbus::policy {

Expert::Expert(const mjModel& model, const model_info_t& info, int max_attempts)
    : context_(model, info), max_attempts_(max_attempts) {
  for (int arm = 0; arm < info.num_arms; ++arm) arms_.push_back(arm);
}

void Expert::Begin(const episode_begin_t&) {
  player_.Reset(context_.home);
  attempts_ = 0;
}

void Expert::Act(const state_t& state, action_t* action) {
  const double time = static_cast<double>(state.header.sim_time_us) * 1e-6;
  const Configuration* commanded = &player_.At(time);
  if (player_.done()) {
    context_.effort_left = PlanningContext::kEffort;
    player_.Start(Next(*commanded, state), time);
    commanded = &player_.At(time);
  }
  SetAction(*commanded, action);
}

void NeedTwoArms(const model_info_t& info) {
  if (info.num_arms == 2) return;
  throw InputError("policy \"expert\": " + info.task + " needs a robot with two arms");
}

void SetAction(const Configuration& configuration, action_t* action) {
  action->mode = action_t::JOINT_POSITION;
  action->joint_position_rad.clear();
  for (const JointVector& joints : configuration.joints) {
    action->joint_position_rad.insert(action->joint_position_rad.end(), joints.begin(), joints.end());
  }
  action->num_joints = static_cast<int32_t>(action->joint_position_rad.size());
  action->gripper_closing = configuration.closing;
  action->num_grippers = static_cast<int32_t>(configuration.closing.size());
  action->error.clear();
}

namespace {

using Factory = std::function<std::unique_ptr<Policy>(const mjModel&, const model_info_t&)>;

Factory LiftByHandles(const HandledObject& object) {
  return [object](const mjModel& model, const model_info_t& info) {
    return std::make_unique<LiftByHandlesExpert>(object, model, info);
  };
}

template <class T>
std::unique_ptr<Policy> Make(const mjModel& model, const model_info_t& info) {
  return std::make_unique<T>(model, info);
}

// By task.
const std::map<std::string, Factory>& Experts() {
  static const std::map<std::string, Factory> experts = {
      {"cube_handover", Make<CubeHandoverExpert>},
      {"lift_pot",
       LiftByHandles({.name = "pot", .sweet_spot = {0.62, 0}, .drags = {0.25, 0.5, 0.75, 1}, .max_y = 1})},
      {"lift_tray",
       LiftByHandles(
           {.name = "tray", .sweet_spot = {0.6, -0.325}, .drags = {0.25, 0.5, 0.75, 1}, .max_y = -0.02})},
      {"pack_box", Make<PackBoxExpert>},
      {"rotate_valve", Make<RotateValveExpert>},
      {"pick_single_book_from_table", Make<SingleBookExpert>},
      {"stack_single_book_shelf", Make<SingleBookExpert>},
      {"stack_two_blocks", Make<StackTwoBlocksExpert>},
  };
  return experts;
}

}  // namespace

std::unique_ptr<Policy> MakeExpert(const mjModel& model, const model_info_t& info) {
  const auto expert = Experts().find(info.task);
  if (expert != Experts().end()) return expert->second(model, info);
  std::string known;
  for (const auto& [task, unused] : Experts()) known += (known.empty() ? "" : ", ") + task;
  throw InputError("policy \"expert\": there is none for task \"" + info.task + "\"; there is one for " +
                   known);
}

}  // namespace evalbus::policy
