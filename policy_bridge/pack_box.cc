#include "policy_bridge/pack_box.h"

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

// A flap of 0.212 m resists with 10 N m s/rad: 0.5 rad/s at the peak of the arc take 25 N at the fingers.
constexpr double kFlapLength = 0.212;  // m
constexpr double kFlapHalfThickness = 0.002;
constexpr double kSpeed = 0.1;  // m/s
// Where on the flap the fingers push, from the fold.
constexpr double kRadius = 0.195;  // m
// Closed is within a tenth of the flap's range of 160 degrees.
constexpr double kClosed = 0.1;
constexpr double kRest = 5 * kDegree;  // left to go at the end of the push
constexpr double kBeside = 0.08;       // m, along the fingers, from beside the flap to under it
constexpr double kOver = 0.12;         // m, above that
constexpr double kBack = 0.06;         // m, after the push
// Half extents of a closed pair of fingers along and across the way they close, and room to the flap's edge.
constexpr double kFingers[] = {0.026, 0.0105};
constexpr double kRoom = 0.006;

// Steepness of the fingers above the horizontal, the side that the hand comes from, where along the fold (m,
// towards the robot first), how the hand is rolled about the fingers, and how far it turns with the flap.
constexpr double kSides[] = {0, 35 * kDegree, -35 * kDegree, 70 * kDegree, -70 * kDegree};
constexpr double kSteepness[] = {40 * kDegree, 55 * kDegree, 68 * kDegree};
constexpr double kAlong[] = {0, -0.1, 0.1, -0.18};
constexpr double kRolls[] = {0, 180 * kDegree, 90 * kDegree, -90 * kDegree};
constexpr double kFollows[] = {0.1, 0.3};

constexpr size_t kPairs = 4;
// Then the expert gives up and rests.
constexpr int kMaxAttempts = 6;

}  // namespace

PackBoxExpert::PackBoxExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info), flaps_{BodyId(model, "box/left_flap"), BodyId(model, "box/right_flap")} {
  if (info.num_arms != 2) throw InputError("policy \"expert\": pack_box needs a robot with two arms");
}

void PackBoxExpert::Begin(const episode_begin_t& begin) {
  Expert::Begin(begin);
  attempts_ = 0;
}

Plan PackBoxExpert::CloseFlaps(const Plan& plan, const std::vector<Way>& ways) {
  std::vector<int> arms;
  std::vector<GripGoal> over, beside, under, back;
  std::vector<Turning> turnings;
  for (const Way& way : ways) {
    const int arm = way.turning.arm;
    arms.push_back(arm);
    over.push_back({arm, way.over});
    beside.push_back({arm, way.beside});
    under.push_back({arm, way.under});
    turnings.push_back(way.turning);
  }
  Plan attempt = plan;
  attempt.Close(arms).Reach(over).Reach(beside).Approach(under).Turn(turnings, kSpeed);
  for (const int arm : arms) back.push_back({arm, attempt.GripPose(arm) * Translation3d(0, 0, -kBack)});
  attempt.Approach(back).CheckContacts(arms);
  return attempt;
}

std::vector<PackBoxExpert::Way> PackBoxExpert::Ways(const Plan& plan, const state_t& state, int arm,
                                                    size_t count) {
  const Isometry3d flap = plan.PoseOf(flaps_[arm]);
  const Hinge hinge = context().probe.HingeOf(flaps_[arm], state);
  const Vector3d fold = flap.linear().col(1), up = Vector3d::UnitZ(), out = fold.cross(up);
  // Along the fold towards the robot's side of the box.
  const Vector3d nearer = fold.x() < 0 ? fold : Vector3d(-fold);
  std::vector<Way> ways;
  for (const double side : kSides) {
    for (const double steepness : kSteepness) {
      // From the finger tips to the wrist, and the same seen along the fold: out from it, away from the flap.
      const Vector3d hand = std::cos(steepness) * (AngleAxisd(side, up) * out) + std::sin(steepness) * up;
      const double across = hand.dot(flap.linear().col(0)), off = hand.dot(flap.linear().col(2));
      if (across <= 0.1) continue;
      for (const double roll : kRolls) {
        const Vector3d closing = AngleAxisd(roll, hand) * (fold - hand * hand.dot(fold)).normalized();
        const double half = std::abs(std::cos(roll)) * kFingers[1] + std::abs(std::sin(roll)) * kFingers[0];
        // Below the flap such that the fingers pass its edge at this distance.
        const double depth =
            kFlapHalfThickness +
            ((half + kRoom) * std::hypot(across, off) + (kFlapLength - kRadius) * off) / across;
        for (const double along : kAlong) {
          for (const double follow : kFollows) {
            if (ways.size() >= count) return ways;
            Way way;
            way.under = GripFrame(flap * Vector3d(kRadius, 0, -depth) - along * nearer, -hand, closing);
            way.beside = way.under * Translation3d(0, 0, -kBeside);
            way.over = Translation3d(0, 0, kOver) * way.beside;
            const double slack = std::atan2(depth - kFlapHalfThickness - kFingers[1], kRadius);
            way.turning = {.arm = arm,
                           .body = flaps_[arm],
                           .angle = -(hinge.angle - hinge.lower - kRest + slack),
                           .follow = follow,
                           .slack = -slack};
            if (CloseFlaps(plan, {way}).feasible()) ways.push_back(way);
          }
        }
      }
    }
  }
  return ways;
}

std::vector<Motion> PackBoxExpert::Next(const Configuration& now, const state_t& state) {
  std::vector<int> open;
  for (const int arm : {kRight, kLeft}) {
    const Hinge hinge = context().probe.HingeOf(flaps_[arm], state);
    if (hinge.angle - hinge.lower > kClosed * (hinge.upper - hinge.lower)) open.push_back(arm);
  }
  if (open.empty() || attempts_++ >= kMaxAttempts) return {};
  const Plan start = MakePlan(now, state);
  if (open.size() == 2) {
    const std::vector<Way> lefts = Ways(start, state, kLeft, kPairs);
    const std::vector<Way> rights = lefts.empty() ? lefts : Ways(start, state, kRight, kPairs);
    for (const Way& left : lefts) {
      for (const Way& right : rights) {
        const Plan attempt = CloseFlaps(start, {left, right});
        if (attempt.feasible()) return attempt.motions();
      }
    }
  }
  for (const int arm : open) {
    const std::vector<Way> ways = Ways(start, state, arm, 1);
    if (!ways.empty()) return CloseFlaps(start, ways).GoHome({arm}).motions();
  }
  return {};
}

}  // namespace evalbus
