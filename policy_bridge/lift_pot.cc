#include "policy_bridge/lift_pot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bus/errors.h"

namespace evalbus {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr int kLeft = 0, kRight = 1;
constexpr double kDegree = std::numbers::pi / 180;

// The task asks for 0.1 m.
constexpr double kLiftHeight = 0.125;
constexpr double kHeldHeight = 0.1;
// Way of the hand from above the handle to the grasp.
constexpr double kApproach = 0.09;
// A hand that leans back reaches farther. It takes the handle's bar nearer to the robot, and higher, so that
// the palm stays clear of the bar.
struct Style {
  double tilt;
  double forward, up;  // of the bar's middle, m
};
constexpr Style kStyles[] = {
    {0, 0, 0}, {15 * kDegree, -0.01, 0}, {30 * kDegree, -0.03, 0}, {40 * kDegree, -0.04, 0.008}};
// Out of reach of the height wanted, the pot comes towards the robot while it is lifted.
constexpr double kPulls[] = {0, 0.05, 0.1, 0.15, 0.2};
// A grasp must allow at least this much lift on the spot.
constexpr double kFirstLift = 0.02;
// Where both arms reach best, and how much of the way there a dragged pot goes.
constexpr double kSweetSpot[] = {0.62, 0.0};
constexpr double kDrags[] = {0.25, 0.5, 0.75, 1};
// Then the expert gives up and rests.
constexpr int kMaxAttempts = 4;

double Yaw(const Isometry3d& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

Isometry3d Upright(const Vector3d& position, double yaw) {
  return Translation3d(position) * AngleAxisd(yaw, Vector3d::UnitZ());
}

Isometry3d Raised(const Isometry3d& pose, double height) { return Translation3d(0, 0, height) * pose; }

}  // namespace

LiftPotExpert::LiftPotExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info), pot_body_(ObjectBody(info, "pot")) {
  if (info.num_arms != 2) throw InputError("policy \"expert\": lift_pot needs a robot with two arms");
  handles_[kLeft] = SiteInBody(model, "pot/left_handle", pot_body_).translation();
  handles_[kRight] = SiteInBody(model, "pot/right_handle", pot_body_).translation();
}

void LiftPotExpert::Begin(const episode_begin_t& begin) {
  Expert::Begin(begin);
  attempts_ = 0;
}

std::vector<LiftPotExpert::Grasp> LiftPotExpert::Grasps(int handle) const {
  std::vector<Grasp> grasps;
  for (const Style& style : kStyles) {
    const Vector3d approach(std::sin(style.tilt), 0, -std::cos(style.tilt));
    // The pads close along the pot's y, either of them in front.
    for (double sign : {1.0, -1.0}) {
      const Vector3d closing = sign * Vector3d::UnitY();
      Grasp grasp;
      grasp.at.makeAffine();
      grasp.at.linear() << closing.cross(approach), closing, approach;
      grasp.at.translation() = handles_[handle] + Vector3d(style.forward, 0, style.up);
      grasp.before = Translation3d(-kApproach * approach) * grasp.at;
      grasps.push_back(grasp);
    }
  }
  return grasps;
}

bool LiftPotExpert::CanTake(const Plan& plan, int arm, const Isometry3d& pot, const Grasp& grasp) const {
  Plan attempt = plan;
  attempt.Reach({{arm, pot * grasp.before}})
      .Approach({{arm, pot * grasp.at}})
      .Carry(pot_body_, pot, Raised(pot, kFirstLift), {arm})
      .CheckContacts({arm});
  return attempt.feasible();
}

std::optional<Plan> LiftPotExpert::Lift(const Plan& plan, const Isometry3d& pot) const {
  const std::vector<Grasp> rights = Grasps(kRight);
  // Found out when first needed.
  std::vector<std::optional<bool>> can_take(rights.size());
  for (const Grasp& left : Grasps(kLeft)) {
    if (!CanTake(plan, kLeft, pot, left)) continue;
    for (size_t i = 0; i < rights.size(); ++i) {
      const Grasp& right = rights[i];
      if (!can_take[i]) can_take[i] = CanTake(plan, kRight, pot, right);
      if (!*can_take[i]) continue;
      Plan grasped = plan;
      grasped.Reach({{kLeft, pot * left.before}, {kRight, pot * right.before}})
          .Approach({{kLeft, pot * left.at}, {kRight, pot * right.at}})
          .Close({kLeft, kRight})
          .CheckContacts({kLeft, kRight});
      for (double pull : kPulls) {
        if (!grasped.feasible()) break;
        const Vector3d lifted = pot.translation() + Vector3d(-pull, 0, kLiftHeight);
        Plan attempt = grasped;
        attempt.Carry(pot_body_, pot, Upright(lifted, Yaw(pot)), {kLeft, kRight})
            .CheckContacts({kLeft, kRight});
        if (attempt.feasible()) return attempt;
      }
    }
  }
  return std::nullopt;
}

std::optional<Plan> LiftPotExpert::Drag(const Plan& plan, const Isometry3d& pot) const {
  const Vector3d sweet_spot(kSweetSpot[0], kSweetSpot[1], pot.translation().z());
  for (int arm : {kLeft, kRight}) {
    for (int handle : {kLeft, kRight}) {
      for (const Grasp& grasp : Grasps(handle)) {
        Plan grasped = plan;
        grasped.Reach({{arm, pot * grasp.before}})
            .Approach({{arm, pot * grasp.at}})
            .Close({arm})
            .CheckContacts({kLeft, kRight});
        for (double drag : kDrags) {
          if (!grasped.feasible()) break;
          const Isometry3d nearer =
              Upright((1 - drag) * pot.translation() + drag * sweet_spot, (1 - drag) * Yaw(pot));
          Plan attempt = grasped;
          attempt.Carry(pot_body_, pot, nearer, {arm})
              .Open({arm})
              .Approach({{arm, nearer * grasp.before}})
              .CheckContacts({kLeft, kRight});
          if (arm != handle) attempt.GoHome({arm});
          if (attempt.feasible() && Lift(attempt, nearer)) return attempt;
        }
      }
    }
  }
  return std::nullopt;
}

std::vector<Motion> LiftPotExpert::Next(const Configuration& now, const state_t& state) {
  const Isometry3d pot = BodyPose(state, pot_body_);
  if (attempts_ == 0) start_height_ = pot.translation().z();
  const bool holding = now.closing[kLeft] > 0 && now.closing[kRight] > 0;
  if (holding && pot.translation().z() > start_height_ + kHeldHeight) return {};
  if (attempts_++ < kMaxAttempts) {
    Plan start = MakePlan(now, state);
    if (now.closing[kLeft] > 0 || now.closing[kRight] > 0) {
      // The pot slipped, or was missed.
      std::vector<GripGoal> back;
      for (int arm : {kLeft, kRight}) {
        back.push_back(
            {arm, context().arms[arm].GripPose(now.joints[arm]) * Translation3d(0, 0, -kApproach)});
      }
      start.Open({kLeft, kRight}).Approach(back);
    }
    if (auto plan = Lift(start, pot)) return plan->motions();
    if (auto plan = Drag(start, pot)) return plan->motions();
  }
  return {};
}

}  // namespace evalbus
