#include "policy_bridge/lift_pot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

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
// A tilted hand leans towards the robot: it reaches farther, and takes the handle nearer to the robot so that it stays
// clear of the pot's wall.
constexpr double kTilts[] = {0, 15 * kDegree, 30 * kDegree, 45 * kDegree, 60 * kDegree};
constexpr double kTiltedShift = -0.02;
// Out of reach of the height wanted, the pot comes towards the robot while it is lifted.
constexpr double kPulls[] = {0, 0.05, 0.1, 0.15, 0.2};
// A grasp must allow at least this much lift on the spot.
constexpr double kFirstLift = 0.02;
// Where both arms reach best, and how much of the way there a dragged pot goes.
constexpr double kSweetSpot[] = {0.62, 0.0};
constexpr double kDrags[] = {0.25, 0.5, 0.75, 1};
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

std::vector<LiftPotExpert::Grasp> LiftPotExpert::Grasps(int arm) const {
  std::vector<Grasp> grasps;
  for (double tilt : kTilts) {
    const Vector3d approach(std::sin(tilt), 0, -std::cos(tilt));
    const Vector3d position = handles_[arm] + Vector3d(tilt > 0 ? kTiltedShift : 0, 0, 0);
    // The pads close along the pot's y, either of them in front.
    for (double sign : {1.0, -1.0}) {
      const Vector3d closing = sign * Vector3d::UnitY();
      Grasp grasp;
      grasp.at.makeAffine();
      grasp.at.linear() << closing.cross(approach), closing, approach;
      grasp.at.translation() = position;
      grasp.before = Translation3d(-kApproach * approach) * grasp.at;
      grasps.push_back(grasp);
    }
  }
  return grasps;
}

std::vector<LiftPotExpert::Grasp> LiftPotExpert::FeasibleGrasps(int arm, const Isometry3d& pot,
                                                                const Configuration& now, const state_t& state) {
  std::vector<Grasp> feasible;
  for (const Grasp& grasp : Grasps(arm)) {
    Plan plan = MakePlan(now, state);
    plan.Reach({{arm, pot * grasp.before}})
        .Reach({{arm, pot * grasp.at}})
        .Reach({{arm, Raised(pot, kFirstLift) * grasp.at}});
    if (plan.feasible()) feasible.push_back(grasp);
  }
  return feasible;
}

std::optional<Plan> LiftPotExpert::Lift(const Isometry3d& pot, const Configuration& now, const state_t& state) {
  const std::vector<Grasp> lefts = FeasibleGrasps(kLeft, pot, now, state);
  const std::vector<Grasp> rights = FeasibleGrasps(kRight, pot, now, state);
  for (const Grasp& left : lefts) {
    for (const Grasp& right : rights) {
      for (double pull : kPulls) {
        const Vector3d lifted = pot.translation() + Vector3d(-pull, 0, kLiftHeight);
        Plan plan = MakePlan(now, state);
        plan.Reach({{kLeft, pot * left.before}, {kRight, pot * right.before}})
            .Reach({{kLeft, pot * left.at}, {kRight, pot * right.at}})
            .Close({kLeft, kRight})
            .Carry(pot_body_, pot, Upright(lifted, Yaw(pot)), {kLeft, kRight})
            .CheckContacts();
        if (plan.feasible()) return plan;
      }
    }
  }
  return std::nullopt;
}

std::optional<Plan> LiftPotExpert::Drag(const Isometry3d& pot, const Configuration& now, const state_t& state) {
  const Vector3d sweet_spot(kSweetSpot[0], kSweetSpot[1], pot.translation().z());
  for (double drag : kDrags) {
    const Isometry3d nearer =
        Upright((1 - drag) * pot.translation() + drag * sweet_spot, (1 - drag) * Yaw(pot));
    const bool reachable = !FeasibleGrasps(kLeft, nearer, now, state).empty() &&
                           !FeasibleGrasps(kRight, nearer, now, state).empty();
    if (!reachable) continue;
    for (int arm : {kLeft, kRight}) {
      for (const Grasp& grasp : Grasps(arm)) {
        Plan plan = MakePlan(now, state);
        plan.Reach({{arm, pot * grasp.before}})
            .Reach({{arm, pot * grasp.at}})
            .Close({arm})
            .Carry(pot_body_, pot, nearer, {arm})
            .CheckContacts()
            .Open({arm})
            .Reach({{arm, nearer * grasp.before}})
            .GoHome({arm});
        if (plan.feasible()) return plan;
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
    if (auto plan = Lift(pot, now, state)) return plan->motions();
    if (auto plan = Drag(pot, now, state)) return plan->motions();
  }
  throw std::runtime_error("expert: no way to lift the pot at (" + std::to_string(pot.translation().x()) + ", " +
                           std::to_string(pot.translation().y()) + ") m, yaw " + std::to_string(Yaw(pot)) + " rad");
}

}  // namespace evalbus
