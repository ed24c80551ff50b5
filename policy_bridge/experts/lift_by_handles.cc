// Scripted expert for LiftPot and LiftTray. Each hand grasps a handle of the object, then both hands lift the
// object and keep it level. If the arms cannot both reach the object at the same time, one hand first drags
// it nearer.
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/angles.h"
#include "base/errors.h"
#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

// kLiftHeight: height by which the object is lifted, m; the task requires 0.1 m. kHeldHeight: if the object
// is higher than this above its start height, m, it counts as lifted.
constexpr double kLiftHeight = 0.125;
constexpr double kHeldHeight = 0.1;
// How a hand leans while it holds a handle. A hand that is tilted toward the robot reaches farther, but
// grasps the handle's bar nearer to the robot and, if tilted most, higher, so that the palm stays clear of
// the bar. A hand that leans outward has more room if a wall is close to the bar.
struct Style {
  double tilt;         // toward the robot, rad
  double forward, up;  // from the bar's middle, m
};
constexpr double kOutwardLeans[] = {0, 75 * kDegree};
constexpr Style kStyles[] = {
    {0, 0, 0}, {15 * kDegree, -0.01, 0}, {30 * kDegree, -0.03, 0}, {40 * kDegree, -0.04, 0.008}};
// If the target height is out of reach, the object is moved toward the robot by this much (m) while it is
// lifted.
constexpr double kPulls[] = {0, 0.05, 0.1, 0.15, 0.2};
// A grasp must allow at least this much lift without moving the object horizontally, m.
constexpr double kFirstLift = 0.02;
// Below these speeds for kRestUs, the object counts as at rest.
constexpr double kRestSpeed = 0.005;    // m/s
constexpr double kRestTurnRate = 0.05;  // rad/s
constexpr int64_t kRestUs = 100'000;
// Plans are made only after both grippers have opened this far. They are closed when an episode begins, and
// with --latency a plan would be made from such an early state.
constexpr double kOpen = 0.5;

double Yaw(const Isometry3d& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

Isometry3d Upright(const Vector3d& position, double yaw) {
  return Translation3d(position) * AngleAxisd(yaw, Vector3d::UnitZ());
}

Isometry3d Raised(const Isometry3d& pose, double height) { return Translation3d(0, 0, height) * pose; }

class LiftByHandlesExpert : public Expert {
 public:
  // Throws InputError if the model lacks the object or one of its handle sites, or does not have two arms.
  LiftByHandlesExpert(const HandledObject& object, const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Returns grasps of a handle. The most upright grasp comes first.
  std::vector<Grasp> Grasps(int handle) const;
  // Returns whether the arm can grasp and raise the object this way after `plan`.
  bool CanTake(const Plan& plan, int arm, const Eigen::Isometry3d& object, const Grasp& grasp) const;
  // Returns `plan` extended by the motions in which both hands lift the object from its current position;
  // nullopt if this is impossible.
  std::optional<Plan> Lift(const Plan& plan, const Eigen::Isometry3d& object) const;
  // Returns `plan` extended by the motions in which one hand drags the object to a position from which Lift
  // is possible; nullopt if there is none.
  std::optional<Plan> Drag(const Plan& plan, const Eigen::Isometry3d& object) const;
  // Returns true if the object has not moved for kRestUs. Some tasks drop it onto its support.
  bool IsAtRest(const state_t& state);

  HandledObject object_;
  int body_;
  // Index of the object's free joint in qvel.
  int velocity_;
  // Middle of the left and right handle bar, in the object's frame; m.
  Eigen::Vector3d handles_[2];
  // Time at which the object last moved, us.
  int64_t moved_us_ = 0;
  // Height of the object's origin when it was first at rest, m.
  double start_height_ = 0;
};

}  // namespace

LiftByHandlesExpert::LiftByHandlesExpert(const HandledObject& object, const mjModel& model,
                                         const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/4),
      object_(object),
      body_(ObjectBody(info, object.name)),
      velocity_(model.body_dofadr[body_]) {
  NeedTwoArms(info);
  if (model.body_dofnum[body_] != 6)
    throw InputError("object \"" + object.name + "\": expected a free scene part, which can be lifted");
  handles_[kLeft] = SiteInBody(model, object.name + "/left_handle", body_).translation();
  handles_[kRight] = SiteInBody(model, object.name + "/right_handle", body_).translation();
}

void LiftByHandlesExpert::Begin(const episode_begin_t& begin) {
  Expert::Begin(begin);
  moved_us_ = 0;
}

bool LiftByHandlesExpert::IsAtRest(const state_t& state) {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> velocity(state.qvel_mixed.data() + velocity_);
  if (velocity.head<3>().norm() > kRestSpeed || velocity.tail<3>().norm() > kRestTurnRate) {
    moved_us_ = state.header.sim_time_us;
  }
  return state.header.sim_time_us - moved_us_ >= kRestUs;
}

std::vector<Grasp> LiftByHandlesExpert::Grasps(int handle) const {
  std::vector<Grasp> grasps;
  const double outward = handles_[handle].y() > 0 ? 1 : -1;
  for (const double lean : kOutwardLeans) {
    const AngleAxisd leaning(-outward * lean, Vector3d::UnitX());
    for (const Style& style : kStyles) {
      const Vector3d approach = leaning * Vector3d(std::sin(style.tilt), 0, -std::cos(style.tilt));
      // The pads close across the bar, and either pad may be in front.
      for (double sign : {1.0, -1.0}) {
        Grasp grasp;
        grasp.at = GripFrame(handles_[handle] + Vector3d(style.forward, 0, style.up), approach,
                             sign * (leaning * Vector3d::UnitY()));
        grasp.before = Translation3d(-kGraspApproach * approach) * grasp.at;
        grasps.push_back(grasp);
      }
    }
  }
  return grasps;
}

bool LiftByHandlesExpert::CanTake(const Plan& plan, int arm, const Isometry3d& object,
                                  const Grasp& grasp) const {
  Plan attempt = plan;
  attempt.Reach({{arm, object * grasp.before}})
      .Approach({{arm, object * grasp.at}})
      .Carry(body_, object, Raised(object, kFirstLift), {arm})
      .CheckContacts({arm});
  return attempt.feasible();
}

std::optional<Plan> LiftByHandlesExpert::Lift(const Plan& plan, const Isometry3d& object) const {
  if (object.translation().y() > object_.max_y) return std::nullopt;
  const std::vector<Grasp> rights = Grasps(kRight);
  // Results of CanTake() for the right hand, each evaluated on first use.
  std::vector<std::optional<bool>> can_take(rights.size());
  for (const Grasp& left : Grasps(kLeft)) {
    if (!CanTake(plan, kLeft, object, left)) continue;
    for (size_t i = 0; i < rights.size(); ++i) {
      const Grasp& right = rights[i];
      if (!can_take[i]) can_take[i] = CanTake(plan, kRight, object, right);
      if (!*can_take[i]) continue;
      Plan grasped = plan;
      grasped.Reach({{kLeft, object * left.before}, {kRight, object * right.before}})
          .Approach({{kLeft, object * left.at}, {kRight, object * right.at}})
          .Close({kLeft, kRight})
          .CheckContacts({kLeft, kRight});
      for (double pull : kPulls) {
        if (!grasped.feasible()) break;
        const Vector3d lifted = object.translation() + Vector3d(-pull, 0, kLiftHeight);
        Plan attempt = grasped;
        attempt.Carry(body_, object, Upright(lifted, Yaw(object)), {kLeft, kRight})
            .CheckContacts({kLeft, kRight});
        if (attempt.feasible()) return attempt;
      }
    }
  }
  return std::nullopt;
}

std::optional<Plan> LiftByHandlesExpert::Drag(const Plan& plan, const Isometry3d& object) const {
  const Vector3d sweet_spot(object_.sweet_spot.x(), object_.sweet_spot.y(), object.translation().z());
  for (int arm : {kLeft, kRight}) {
    for (int handle : {kLeft, kRight}) {
      for (const Grasp& grasp : Grasps(handle)) {
        Plan grasped = plan;
        grasped.Reach({{arm, object * grasp.before}})
            .Approach({{arm, object * grasp.at}})
            .Close({arm})
            .CheckContacts({kLeft, kRight});
        for (double drag : object_.drags) {
          if (!grasped.feasible()) break;
          const Isometry3d nearer =
              Upright((1 - drag) * object.translation() + drag * sweet_spot, (1 - drag) * Yaw(object));
          Plan attempt = grasped;
          attempt.Carry(body_, object, nearer, {arm})
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

std::vector<Motion> LiftByHandlesExpert::Next(const Configuration& now, const state_t& state) {
  const Isometry3d object = BodyPose(state, body_);
  const bool are_open = std::ranges::all_of(state.gripper, [](const auto& g) { return g.opening >= kOpen; });
  if ((!IsAtRest(state) || !are_open) && attempts_ == 0) return {};
  if (attempts_ == 0) start_height_ = object.translation().z();
  const bool holding = now.closing[kLeft] > 0 && now.closing[kRight] > 0;
  if (holding && object.translation().z() > start_height_ + kHeldHeight) return {};
  if (gives_up()) return {};
  ++attempts_;
  Plan start = MakePlan(now, state);
  if (now.closing[kLeft] > 0 || now.closing[kRight] > 0) {
    // A closed gripper means that the object has slipped or that the grasp has missed it, so the hands
    // retreat first.
    std::vector<GripGoal> back;
    for (int arm : {kLeft, kRight}) {
      back.push_back(
          {arm, context().arms[arm].GripPose(now.joints[arm]) * Translation3d(0, 0, -kGraspApproach)});
    }
    start.Open({kLeft, kRight}).Approach(back);
  }
  if (auto plan = Lift(start, object)) return plan->motions();
  if (auto plan = Drag(start, object)) return plan->motions();
  return {};
}

std::unique_ptr<Expert> MakeLiftByHandlesExpert(const HandledObject& object, const mjModel& model,
                                                const model_info_t& info) {
  return std::make_unique<LiftByHandlesExpert>(object, model, info);
}

}  // namespace evalbus::policy
