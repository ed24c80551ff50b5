#include "policy_bridge/policies/flawed_policy.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/errors.h"
#include "base/suggestion.h"
#include "policy_bridge/planning/ik.h"
#include "policy_bridge/planning/min_jerk.h"

namespace evalbus::policy {
namespace {

// kMoved, kTurned: an object that moved or turned at least this far counts as moved. kRaised: height at which
// kDrop opens the grippers.
constexpr double kMoved = 0.01;   // m
constexpr double kTurned = 0.1;   // rad
constexpr double kRaised = 0.02;  // m

constexpr double kShortBy = 0.08;  // m, distance by which a grasp is missed
constexpr double kMissTime = 1;    // s
// The grippers open for this time once per period.
constexpr int64_t kLooseTime_us = 100000, kLoosePeriod_us = 500000;
// The hands move down at kDownSpeed. They also move outward, by the fraction kAside of the way down, to pass
// objects in front of the robot.
constexpr double kDownSpeed = 0.15;  // m/s
constexpr double kMaxDown = 0.6;     // m
constexpr double kAside = 0.7;
constexpr int kSlowness = 10;

constexpr std::array<std::pair<const char*, Flaw>, 9> kFlaws = {{{"miss", Flaw::kMiss},
                                                                 {"slip", Flaw::kSlip},
                                                                 {"early", Flaw::kEarly},
                                                                 {"drop", Flaw::kDrop},
                                                                 {"stop", Flaw::kStop},
                                                                 {"collide", Flaw::kCollide},
                                                                 {"slow", Flaw::kSlow},
                                                                 {"error", Flaw::kError},
                                                                 {"nan", Flaw::kNan}}};

}  // namespace

Flaw FindFlaw(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& [known, flaw] : kFlaws) {
    if (name == known) return flaw;
    names.emplace_back(known);
  }
  throw InputError("policy \"flawed_expert\": there is no flaw \"" + name + "\"" +
                   Suggestion(name, names, "; expected one of " + FlawNames()));
}

std::string FlawNames() {
  std::string list;
  for (const auto& [name, unused] : kFlaws) list += std::string(list.empty() ? "" : ", ") + name;
  return list;
}

FlawedPolicy::FlawedPolicy(std::unique_ptr<Policy> policy, Flaw flaw, const mjModel& model,
                           const model_info_t& info)
    : policy_(std::move(policy)), flaw_(flaw), arms_(MakeArms(model, info)) {
  double middle = 0;
  for (const Arm& arm : arms_) {
    side_.push_back(arm.GripPose(arm.chain.home()).translation().y());
    middle += side_.back() / static_cast<double>(arms_.size());
  }
  for (double& side : side_) side = side > middle ? 1 : side < middle ? -1 : 0;
  for (int body = 0; body < info.num_bodies; ++body) {
    if (info.entity_kind[info.body_entity[body]] == model_info_t::OBJECT) bodies_.push_back(body);
  }
}

void FlawedPolicy::Begin(const episode_begin_t& begin) {
  policy_->Begin(begin);
  start_.clear();
  wrong_ = false;
  shifted_.clear();
  for (const Arm& arm : arms_) shifted_.push_back(arm.chain.home());
}

void FlawedPolicy::CheckTrigger(const state_t& state, const action_t& action) {
  if (start_.empty()) {
    const auto& closing = action.gripper_closing;
    if (std::any_of(closing.begin(), closing.end(), [](double x) { return x > 0; })) {
      for (int body : bodies_) start_.push_back(BodyPose(state, body));
    }
    return;
  }
  for (size_t i = 0; i < bodies_.size(); ++i) {
    const Eigen::Isometry3d now = BodyPose(state, bodies_[i]);
    const Eigen::Vector3d way = now.translation() - start_[i].translation();
    const Eigen::Matrix3d turn = now.linear().transpose() * start_[i].linear();
    wrong_ |= flaw_ == Flaw::kDrop ? way.z() >= kRaised
                                   : way.norm() >= kMoved || Eigen::AngleAxisd(turn).angle() >= kTurned;
  }
}

void FlawedPolicy::Shift(double back, double down, action_t* action) {
  size_t first = 0;
  for (size_t i = 0; i < arms_.size(); ++i) {
    const ArmChain& chain = arms_[i].chain;
    const Eigen::Map<JointVector> joints(action->joint_position_rad.data() + first, chain.num_joints());
    const Eigen::Isometry3d wrist = Eigen::Translation3d(0, side_[i] * kAside * down, -down) *
                                    arms_[i].GripPose(joints) * Eigen::Translation3d(0, 0, -back) *
                                    arms_[i].grip.inverse();
    const IkResult ik = SolveIk(chain, wrist, shifted_[i], {.posture = joints});
    if (ik.converged) shifted_[i] = ik.joints;
    for (Eigen::Index j = 0; j < shifted_[i].size(); ++j)
      action->joint_position_rad[first++] = shifted_[i][j];
  }
}

void FlawedPolicy::Act(const state_t& state, action_t* action) {
  if (flaw_ == Flaw::kStop && wrong_) {
    *action = last_;
    return;
  }
  if (flaw_ == Flaw::kSlow) {
    seen_ = state;
    seen_.header.sim_time_us /= kSlowness;
    policy_->Act(seen_, action);
    return;
  }
  policy_->Act(state, action);
  if (!wrong_) {
    CheckTrigger(state, *action);
    wrong_time_us_ = state.header.sim_time_us;
  }
  const double time = static_cast<double>(state.header.sim_time_us) * 1e-6;
  switch (flaw_) {
    case Flaw::kMiss:
      Shift(kShortBy * MinJerk(time / kMissTime), 0, action);
      break;
    case Flaw::kCollide:
      if (state.header.tick == 0) last_ = *action;
      *action = last_;
      Shift(0, std::min(kDownSpeed * time, kMaxDown), action);
      break;
    case Flaw::kSlip:
      if (wrong_ && (state.header.sim_time_us - wrong_time_us_) % kLoosePeriod_us < kLooseTime_us) {
        action->gripper_closing.assign(action->gripper_closing.size(), 0);
      }
      break;
    case Flaw::kEarly:
    case Flaw::kDrop:
      if (wrong_) action->gripper_closing.assign(action->gripper_closing.size(), 0);
      break;
    case Flaw::kStop:
      last_ = *action;
      break;
    case Flaw::kError:
      if (wrong_) throw std::runtime_error("the flawed expert gives up");
      break;
    case Flaw::kNan:
      if (wrong_) action->joint_position_rad[0] = std::numeric_limits<double>::quiet_NaN();
      break;
    case Flaw::kSlow:
      break;
  }
}

}  // namespace evalbus::policy
