// Scripted expert for PackBox. Each hand goes under the flap on its side, pushes the flap up and over, and
// presses it down. Both hands work at the same time or, if they would collide, in turn.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/angles.h"
#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

// Size of the flaps, m.
constexpr double kFlapLengths[] = {0.2124, 0.2226};  // left, right
constexpr double kFlapHalfWidth = 0.21;
constexpr double kFlapHalfThickness = 0.002;
// A flap resists with 10 N m s/rad. At this rate, the force at the fingers, 0.19 m from the fold, is about 26
// N.
constexpr double kTurnRate = 0.5;  // rad/s
// A flap counts as closed within this fraction of its range of 160 degrees. For the right flap, the limit of
// the task is a little larger.
constexpr double kClosedLid = 0.05;
constexpr double kRest = 5 * kDegree;  // angle that remains at the end of the push
constexpr double kBeside = 0.08;       // m, distance along the fingers from beside the flap to below it
constexpr double kBack = 0.03;         // m, retreat after the push
// The flaps overlap by 7 mm when both are closed. The right flap therefore waits at this angle above its
// closed position until the left flap is down. It then comes to rest on the left flap.
constexpr double kWait = 30 * kDegree;
// kFingers: half extents of a closed pair of fingers along and across their closing direction, m. kRoom:
// clearance to the flap, m.
constexpr double kFingers[] = {0.026, 0.0105};
constexpr double kRoom = 0.006;
// Length of the fingers that may be under the flap, m. If it were larger, the palm would touch the flap.
constexpr double kMaxCovered = 0.05;

// Spot at which the fingers push: distance from the free edge, and position along that edge toward the robot,
// m. The palm must stay clear of the flap, so all spots are near the free edge or near the end on the robot's
// side.
struct Spot {
  double inset, along;
};
constexpr Spot kSpots[] = {{0.017, 0},    {0.017, 0.1},  {0.017, -0.1},
                           {0.017, 0.19}, {0.052, 0.19}, {0.092, 0.19}};
// kSides: direction from which the hand comes. 0: across the free edge; 90 degrees: along the fold, from the
// robot. kSteepness: angle of the fingers above the horizontal.
constexpr double kSides[] = {0, 45 * kDegree, 90 * kDegree};
constexpr double kSteepness[] = {40 * kDegree, 55 * kDegree, 20 * kDegree, 68 * kDegree};
// kRolls: roll of the hand about the fingers. kFollows: fraction of the flap's rotation by which the hand
// rotates with it. kOvers: height (m) above the pose beside the flap through which the hand comes.
constexpr double kRolls[] = {0, 180 * kDegree, 90 * kDegree, -90 * kDegree};
constexpr double kFollows[] = {0.1, 0.3, 0.5};
constexpr double kOvers[] = {0, 0.1};

// Maximum number of knots that trying one way may need.
constexpr int kEffortPerWay = 300;

GripGoal Back(const Plan& plan, int arm) { return {arm, plan.GripPose(arm) * Translation3d(0, 0, -kBack)}; }

class PackBoxExpert : public Expert {
 public:
  // Throws InputError unless the model has the bodies box/left_flap and box/right_flap on hinges.
  PackBoxExpert(const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Candidate motion of an arm that closes its flap: grip frames (world frame) above the flap, beside it, and
  // under its edge.
  struct Way {
    Eigen::Isometry3d over, beside, under;
    Turning turning;
  };

  // Returns all candidate motions with which the arm could close its flap, the most natural first. They may
  // be infeasible.
  std::vector<Way> Ways(const state_t& state, int arm);
  // Tries motions of this arm alone, from `start`, until enough feasible ones are known. Returns false if
  // that takes more effort than a tick allows. It must then be called again at the next tick.
  bool Search(const Plan& start, const state_t& state, int arm);
  // Returns `plan` extended by the motions in which the hands go under the flaps.
  static Plan GoUnder(const Plan& plan, const std::vector<Way>& ways);
  // Returns `under` extended by the motions in which the hands close the flaps and move back.
  static Plan CloseFlaps(const Plan& under, const std::vector<Way>& ways);

  // Body of the flap of each arm, and whether the arm is searching.
  std::array<int, 2> flaps_;
  std::array<bool, 2> searching_ = {};
  std::array<std::vector<Way>, 2> untried_, possible_;
};

}  // namespace

PackBoxExpert::PackBoxExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/6),
      flaps_{BodyId(model, "box/left_flap"), BodyId(model, "box/right_flap")} {
  NeedTwoArms(info);
}

void PackBoxExpert::Begin(const episode_begin_t& begin) {
  Expert::Begin(begin);
  searching_ = {};
}

Plan PackBoxExpert::GoUnder(const Plan& plan, const std::vector<Way>& ways) {
  std::vector<int> arms;
  std::vector<GripGoal> over, beside, under;
  for (const Way& way : ways) {
    const int arm = way.turning.arm;
    arms.push_back(arm);
    over.push_back({arm, way.over});
    beside.push_back({arm, way.beside});
    under.push_back({arm, way.under});
  }
  Plan attempt = plan;
  attempt.Close(arms).Swing(over).Reach(beside).Approach(under).CheckContacts(arms);
  return attempt;
}

Plan PackBoxExpert::CloseFlaps(const Plan& under, const std::vector<Way>& ways) {
  std::vector<Turning> first, last;
  for (const Way& way : ways) {
    first.push_back(way.turning);
    if (ways.size() == 1 || way.turning.arm != kRight) continue;
    first.back().angle += kWait;
    last.push_back({.arm = kRight, .body = way.turning.body, .angle = -kWait, .follow = way.turning.follow});
  }
  const double speed = kTurnRate * kFlapLengths[kRight];
  Plan attempt = under;
  attempt.Turn(first, speed);
  if (!last.empty()) attempt.Approach({Back(attempt, kLeft)}).Turn(last, speed);
  attempt.Approach({Back(attempt, last.empty() ? first.front().arm : kRight)});
  std::vector<int> arms;
  for (const Turning& turning : first) arms.push_back(turning.arm);
  attempt.CheckContacts(arms);
  return attempt;
}

std::vector<PackBoxExpert::Way> PackBoxExpert::Ways(const state_t& state, int arm) {
  const Isometry3d flap = BodyPose(state, flaps_[arm]);
  const Hinge hinge = context().probe.HingeOf(flaps_[arm], state);
  const Vector3d fold = flap.linear().col(1), up = Vector3d::UnitZ(), out = fold.cross(up);
  const Vector3d nearer = fold.x() < 0 ? fold : Vector3d(-fold);
  const Vector3d outwards = flap.linear().col(0), upwards = flap.linear().col(2);
  std::vector<Way> ways;
  for (const Spot& spot : kSpots) {
    const double radius = kFlapLengths[arm] - spot.inset;
    for (const double side : kSides) {
      for (const double steepness : kSteepness) {
        // hand: direction from the finger tips to the wrist. The other variables are its components across
        // the flap, along the flap, and perpendicular to it.
        const Vector3d hand =
            std::cos(steepness) * (std::cos(side) * out + std::sin(side) * nearer) + std::sin(steepness) * up;
        const double across = hand.dot(outwards), along = hand.dot(nearer), off = hand.dot(upwards);
        // Length of the fingers that is under the flap; it depends on which edge the fingers cross.
        const double to_edge = across > 0 ? spot.inset / across : 1;
        const double to_end = along > 0 ? (kFlapHalfWidth - spot.along) / along : 1;
        const double covered = std::min(to_edge, to_end);
        if (covered > kMaxCovered) continue;
        const Vector3d normal = hand.cross(to_edge < to_end ? fold : outwards).normalized();
        for (const double roll : kRolls) {
          const Vector3d closing = AngleAxisd(roll, hand) * hand.cross(upwards).normalized();
          const auto half = [&](const Vector3d& direction) {
            return kFingers[0] * std::abs(direction.dot(closing)) +
                   kFingers[1] * std::abs(direction.dot(hand.cross(closing)));
          };
          // Depth below the flap at which the fingers keep their clearance where they cross the edge.
          const double depth =
              kFlapHalfThickness +
              std::max((half(normal) + kRoom) / std::abs(normal.dot(upwards)) + covered * off,
                       half(upwards) + kRoom);
          const double slack = std::atan2(depth - kFlapHalfThickness - half(upwards), radius);
          Way way;
          way.under = GripFrame(flap * Vector3d(radius, 0, -depth) + spot.along * nearer, -hand, closing);
          way.beside = way.under * Translation3d(0, 0, -kBeside);
          way.turning = {.arm = arm,
                         .body = flaps_[arm],
                         .angle = -(hinge.angle - hinge.lower - kRest + slack),
                         .slack = -slack};
          for (const double over : kOvers) {
            way.over = Translation3d(0, 0, over) * way.beside;
            ways.push_back(way);
          }
        }
      }
    }
  }
  return ways;
}

bool PackBoxExpert::Search(const Plan& start, const state_t& state, int arm) {
  if (!searching_[arm]) {
    untried_[arm] = Ways(state, arm);
    std::reverse(untried_[arm].begin(), untried_[arm].end());
    possible_[arm].clear();
    searching_[arm] = true;
  }
  while (!untried_[arm].empty() && possible_[arm].size() < kPairs) {
    if (context().effort_left < kEffortPerWay) return false;
    Way way = untried_[arm].back();
    untried_[arm].pop_back();
    const Plan under = GoUnder(start, {way});
    for (const double follow : kFollows) {
      way.turning.follow = follow;
      if (!CloseFlaps(under, {way}).feasible()) continue;
      possible_[arm].push_back(way);
      break;
    }
  }
  return true;
}

std::vector<Motion> PackBoxExpert::Next(const Configuration& now, const state_t& state) {
  std::vector<int> open;
  for (const int arm : {kRight, kLeft}) {
    const Hinge hinge = context().probe.HingeOf(flaps_[arm], state);
    if (hinge.angle - hinge.lower > kClosedLid * (hinge.upper - hinge.lower)) open.push_back(arm);
  }
  if (open.empty() || gives_up()) return {};
  const Plan start = MakePlan(now, state);
  // The search may take several ticks. Until it ends, the robot rests.
  for (const int arm : open) {
    if (!Search(start, state, arm)) return {};
  }
  if (context().effort_left < PlanningContext::kEffort) return {};
  ++attempts_;
  searching_ = {};
  if (open.size() == 2) {
    for (const Way& left : possible_[kLeft]) {
      for (const Way& right : possible_[kRight]) {
        const std::vector<Way> both{left, right};
        const Plan attempt = CloseFlaps(GoUnder(start, both), both);
        if (attempt.feasible()) return attempt.motions();
      }
    }
  }
  context().effort_left = PlanningContext::kEffort;
  for (const int arm : open) {
    if (possible_[arm].empty()) continue;
    const std::vector<Way> one{possible_[arm].front()};
    return CloseFlaps(GoUnder(start, one), one).GoHome({arm}).motions();
  }
  return {};
}

std::unique_ptr<Expert> MakePackBoxExpert(const mjModel& model, const model_info_t& info) {
  return std::make_unique<PackBoxExpert>(model, info);
}

}  // namespace evalbus::policy
