// Scripted expert for RotateValve. Each hand takes the hand wheel on its side. Both wheels are turned at the
// same time or, if the hands would collide, in turn.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/angles.h"
#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

// A wheel counts as turned beyond this angle. The task requires a tenth of the wheels' range of 4.71 rad.
constexpr double kEnough = 0.5;  // rad
// Angle by which the hand turns, rad. It is larger than required, because the wheel lags behind the hand.
constexpr double kTurn = 0.8;
constexpr double kSpeed = 0.05;  // m/s of a grip
// Angles by which the hand leans about its closing axis. 0: it comes from above. The others are used if an
// arm or the board is in its way.
constexpr double kLeans[] = {0, 15 * kDegree, -15 * kDegree, 30 * kDegree, -30 * kDegree};
constexpr int kDirections = 12;

class RotateValveExpert : public Expert {
 public:
  // Throws InputError unless the model has the bodies first_valve/wheel and second_valve/wheel on hinges.
  RotateValveExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Returns `plan`, extended by the motions in which the arms take wheels, turn them, release them and go
  // home. moving: the arms whose contacts are checked, including contacts between these arms.
  static Plan TurnWheels(const Plan& plan, const std::vector<Hold>& holds, const std::vector<int>& moving);
  // Returns at most `count` grasps with which the arm alone can take and turn a wheel.
  std::vector<Hold> Holds(const Plan& plan, int arm, int wheel, const std::vector<int>& moving,
                          size_t count) const;
  // Returns `plan`, extended by the motions in which both arms turn one wheel each, at the same time.
  std::optional<Plan> TurnBoth(const Plan& plan, const std::array<int, 2>& wheel_of_arm) const;

  // Bodies of the two wheels.
  std::array<int, 2> wheels_;
};

}  // namespace

RotateValveExpert::RotateValveExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/6),
      wheels_{BodyId(model, "first_valve/wheel"), BodyId(model, "second_valve/wheel")} {
  NeedTwoArms(info);
}

Plan RotateValveExpert::TurnWheels(const Plan& plan, const std::vector<Hold>& holds,
                                   const std::vector<int>& moving) {
  std::vector<int> arms;
  std::vector<Turning> turnings;
  for (const Hold& hold : holds) {
    arms.push_back(hold.arm);
    turnings.push_back({.arm = hold.arm, .body = hold.body, .angle = kTurn});
  }
  Plan attempt = plan;
  attempt.Take(holds).Turn(turnings, kSpeed).Release(arms).GoHome(arms).CheckContacts(moving);
  return attempt;
}

std::vector<Hold> RotateValveExpert::Holds(const Plan& plan, int arm, int wheel,
                                           const std::vector<int>& moving, size_t count) const {
  const Isometry3d to_wheel = plan.PoseOf(wheel).inverse();
  const Vector3d position = plan.PoseOf(wheel).translation();
  const Vector3d now = plan.GripPose(arm).linear().col(1);
  const double yaw = std::atan2(-now.x(), now.y());
  std::vector<Hold> holds;
  for (const double lean : kLeans) {
    for (int i = 0; i < kDirections && holds.size() < count; ++i) {
      // The directions nearest to the hand's current direction come first: steps 0, 1, -1, 2, -2 ...
      const int step = i % 2 ? (i + 1) / 2 : -i / 2;
      const double direction = yaw + step * 2 * std::numbers::pi / kDirections;
      const Vector3d closing(-std::sin(direction), std::cos(direction), 0);
      const Vector3d approach = AngleAxisd(lean, closing) * Vector3d(0, 0, -1);
      const Isometry3d at = GripFrame(position, approach, closing);
      const Isometry3d before = at * Translation3d(0, 0, -kGraspApproach);
      const Hold hold{arm, wheel, {to_wheel * before, to_wheel * at}};
      if (TurnWheels(plan, {hold}, moving).feasible()) holds.push_back(hold);
    }
  }
  return holds;
}

std::optional<Plan> RotateValveExpert::TurnBoth(const Plan& plan,
                                                const std::array<int, 2>& wheel_of_arm) const {
  const std::vector<Hold> lefts = Holds(plan, kLeft, wheel_of_arm[kLeft], {kLeft}, kPairs);
  const std::vector<Hold> rights = Holds(plan, kRight, wheel_of_arm[kRight], {kRight}, kPairs);
  for (const Hold& left : lefts) {
    for (const Hold& right : rights) {
      Plan attempt = TurnWheels(plan, {left, right}, {kLeft, kRight});
      if (attempt.feasible()) return attempt;
    }
  }
  return std::nullopt;
}

std::vector<Motion> RotateValveExpert::Next(const Configuration& now, const state_t& state) {
  std::vector<int> left_to_turn;
  for (const int wheel : wheels_) {
    if (context().probe.HingeOf(wheel, state).angle < kEnough) left_to_turn.push_back(wheel);
  }
  if (left_to_turn.empty() || gives_up()) return {};
  ++attempts_;
  const Plan start = MakePlan(now, state);
  const auto y = [&](int wheel) { return start.PoseOf(wheel).translation().y(); };
  std::sort(left_to_turn.begin(), left_to_turn.end(), [&](int a, int b) { return y(a) > y(b); });
  if (left_to_turn.size() == 2) {
    if (auto plan = TurnBoth(start, {left_to_turn[0], left_to_turn[1]})) return plan->motions();
  }
  for (const int wheel : left_to_turn) {
    const int nearer = y(wheel) > 0 ? kLeft : kRight;
    for (const int arm : {nearer, 1 - nearer}) {
      const std::vector<Hold> holds = Holds(start, arm, wheel, {kLeft, kRight}, 1);
      if (!holds.empty()) return TurnWheels(start, holds, {kLeft, kRight}).motions();
    }
  }
  return {};
}

std::unique_ptr<Expert> MakeRotateValveExpert(const mjModel& model, const model_info_t& info) {
  return std::make_unique<RotateValveExpert>(model, info);
}

}  // namespace evalbus::policy
