#include "policy_bridge/expert.h"

#include "bus/errors.h"
#include "policy_bridge/lift_pot.h"

namespace evalbus {

Expert::Expert(const mjModel& model, const model_info_t& info) : context_(model, info) {}

void Expert::Begin(const episode_begin_t&) { player_.Reset(context_.home); }

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

std::unique_ptr<Policy> MakeExpert(const mjModel& model, const model_info_t& info) {
  if (info.task == "lift_pot") return std::make_unique<LiftPotExpert>(model, info);
  throw InputError("policy \"expert\": there is none for task \"" + info.task +
                   "\"; there is one for lift_pot");
}

}  // namespace evalbus
