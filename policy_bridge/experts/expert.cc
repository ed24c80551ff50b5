#include "policy_bridge/experts/expert.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/errors.h"
#include "models/task_family.h"
#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

// An arm counts as at home if no joint is farther than this from its home position, rad.
constexpr double kAtHome = 0.02;

}  // namespace

Expert::Expert(const mjModel& model, const model_info_t& info, int max_attempts)
    : context_(model, info), max_attempts_(max_attempts), servo_lead_(model, info) {
  for (int arm = 0; arm < info.num_arms; ++arm) {
    arms_.push_back(arm);
    names_.push_back(info.arm[static_cast<size_t>(arm)].name);
  }
}

void Expert::Begin(const episode_begin_t&) {
  player_.Reset(context_.home);
  attempts_ = 0;
  has_planned_ = false;
  takes_over_ = false;
  context_.obstacle.reset();
}

void Expert::TakeOver(const state_t& state, const std::vector<double>& closing) {
  Configuration now = context_.home;
  for (size_t arm = 0; arm < now.joints.size(); ++arm) {
    const std::vector<double>& measured = state.arm[arm].joint_position_rad;
    now.joints[arm] = JointVector::Map(measured.data(), static_cast<Eigen::Index>(measured.size()));
  }
  now.closing = closing;
  player_.Reset(now);
  double away = 0;  // rad
  for (size_t arm = 0; arm < now.joints.size(); ++arm)
    away = std::max(away, (now.joints[arm] - context_.home.joints[arm]).cwiseAbs().maxCoeff());
  takes_over_ = away > kAtHome || !ClosedGrippers(now).empty();
}

std::vector<Motion> Expert::GoHomeFrom(const Configuration& now, const state_t& state) {
  constexpr double kRetreats[] = {0.08, 0.04, 0};  // m
  for (const double retreat : kRetreats) {
    Plan plan = MakePlan(now, state);
    if (const std::vector<int> closed = ClosedGrippers(now); !closed.empty()) plan.Open(closed);
    std::vector<GripGoal> back;
    for (const int arm : arms_)
      back.push_back({arm, plan.GripPose(arm) * Eigen::Translation3d(0, 0, -retreat)});
    if (retreat > 0) plan.Approach(back);
    plan.GoHome(arms_);
    if (plan.feasible()) return plan.motions();
  }
  return {};
}

void Expert::Act(const state_t& state, action_t* action) {
  const double time = static_cast<double>(state.header.sim_time_us) * 1e-6;
  const Configuration* commanded = &player_.At(time);
  if (player_.done()) {
    context_.effort_left = PlanningContext::kEffort;
    const int attempts = attempts_;
    const bool goes_home = std::exchange(takes_over_, false);
    std::vector<Motion> motions = goes_home ? GoHomeFrom(*commanded, state) : Next(*commanded, state);
    has_planned_ |= !goes_home && !motions.empty();
    if (!has_planned_ && attempts_ > attempts && gives_up()) {
      throw std::runtime_error("no plan: " + WhyNoPlan(*commanded, state));
    }
    player_.Start(std::move(motions), time);
    commanded = &player_.At(time);
  }
  servo_lead_.Lead(commanded->joints, player_.Velocity(), &target_.joints);
  target_.closing = commanded->closing;
  SetAction(target_, action);
}

std::string Expert::WhyNoPlan(const Configuration& now, const state_t& state) {
  ContactProbe& probe = context_.probe;
  probe.Set(state);
  for (const int arm : arms_) probe.SetArm(arm, now.joints[static_cast<size_t>(arm)]);
  // A contact in the current configuration blocks every plan. It is therefore reported instead of the
  // obstacle of the best plan.
  if (const auto touch = probe.FindTouch(arms_, {}))
    return probe.InWords(*touch) + ", in the robot's current pose";
  if (!context_.obstacle) return "the search took too long";
  const Obstacle& obstacle = *context_.obstacle;
  if (obstacle.touch) return probe.InWords(*obstacle.touch) + ", on the path that got farthest";
  return fmt::format("arm '{}' does not reach ({:.3f}, {:.3f}, {:.3f}) m, on the path that got farthest",
                     names_[static_cast<size_t>(obstacle.arm)], obstacle.grip.x(), obstacle.grip.y(),
                     obstacle.grip.z());
}

void NeedTwoArms(const model_info_t& info) {
  if (info.num_arms == 2) return;
  throw InputError(info.task + " requires a robot with two arms");
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

using Factory = std::function<std::unique_ptr<Expert>(const mjModel&, const model_info_t&)>;

Factory LiftByHandles(const HandledObject& object) {
  return [object](const mjModel& model, const model_info_t& info) {
    return MakeLiftByHandlesExpert(object, model, info);
  };
}

Factory Book(bool to_shelf) {
  return [to_shelf](const mjModel& model, const model_info_t& info) {
    return MakeSingleBookExpert(to_shelf, model, info);
  };
}

// Experts by task.
const std::map<std::string, Factory>& Experts() {
  static const std::map<std::string, Factory> experts = {
      {"cube_handover", MakeCubeHandoverExpert},
      {"lift_pot",
       LiftByHandles({.name = "pot", .sweet_spot = {0.62, 0}, .drags = {0.25, 0.5, 0.75, 1}, .max_y = 1})},
      {"lift_tray",
       LiftByHandles(
           {.name = "tray", .sweet_spot = {0.6, -0.325}, .drags = {0.25, 0.5, 0.75, 1}, .max_y = -0.02})},
      {"pack_box", MakePackBoxExpert},
      {"rotate_valve", MakeRotateValveExpert},
      {"pick_single_book_from_table", Book(false)},
      {"stack_single_book_shelf", Book(true)},
      {"stack_two_blocks", MakeStackTwoBlocksExpert},
  };
  return experts;
}

}  // namespace

bool HasExpert(const std::string& task) { return Experts().contains(FamilyOf(task)); }

void CheckExpert(const std::string& task, const ExpertUser& user) {
  if (HasExpert(task)) return;
  std::string known;
  for (const auto& [name, unused] : Experts()) known += (known.empty() ? "" : ", ") + name;
  throw InputError(user.name + ": task \"" + task + "\" has no expert; tasks with one: " + known +
                   " (for a copy of one of them, use " + user.usage + ")");
}

std::unique_ptr<Expert> MakeExpert(const std::string& task, const mjModel& model, const model_info_t& info,
                                   const ExpertUser& user) {
  CheckExpert(task, user);
  try {
    return Experts().at(FamilyOf(task))(model, info);
  } catch (const InputError& error) {
    // For example, the tray of roboeval/lift_tray lacks the sites that the tray of lift_tray has.
    throw InputError(user.name + ": " + error.what());
  }
}

}  // namespace evalbus::policy
