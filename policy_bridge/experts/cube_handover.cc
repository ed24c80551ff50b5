// Scripted expert for CubeHandover: one arm takes the rod at its middle or nearer to one end and brings it to
// the middle between the arms. The other arm takes the rod nearer to its other end, and the first arm
// releases it.
#include <cmath>
#include <optional>
#include <vector>

#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kRodLift = 0.12;  // m
// Candidate positions of the rod's middle at the handover, m.
constexpr double kMiddles[][3] = {{0.5, 0, 1.15}, {0.45, 0, 1.2}, {0.55, 0, 1.15}};
// Candidate headings of the rod at the handover, rad. 0: its free end points to the other arm.
constexpr double kHeadings[] = {0, 0.5, -0.5, 1, -1};

// Distances from the rod's middle, toward the giver's end, at which the giver grasps it, m. A heavy rod turns
// slowly between the pads unless it is held near its middle.
constexpr double kGives[] = {0, 0.02, 0.04, 0.063};
// Distance from the rod's middle, toward the other end, at which the receiver grasps it, m. The hands are 63
// mm thick.
constexpr double kReceive = 0.07;

// Returns the graspable part of the rod at distance `y` from its middle. The part is too long for a grasp
// along the rod.
GraspBox Part(double y) { return {{0.02, 0.037, 0.02}, {0, y, 0}}; }

class CubeHandoverExpert : public Expert {
 public:
  // Throws InputError if the model has no rod, or does not have two arms.
  CubeHandoverExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Returns `plan` extended by the motions in which the giver takes the rod at its middle or nearer to `end`
  // (1: its +y, -1: its -y), and hands it over. Returns nullopt if this is impossible.
  std::optional<Plan> HandOver(const Plan& plan, int giver, double end) const;
  // Poses of the rod, after the giver has lifted it, in which the other arm may take it.
  std::vector<Eigen::Isometry3d> Meetings(const Eigen::Isometry3d& rod, int giver, double end) const;

  int rod_;
  // 1 for an arm that stands on the left (+y), otherwise -1.
  double side_[2];
};

}  // namespace

CubeHandoverExpert::CubeHandoverExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/4), rod_(ObjectBody(info, "rod")) {
  NeedTwoArms(info);
  for (int arm : {0, 1}) {
    side_[arm] = context().arms[arm].GripPose(context().home.joints[arm]).translation().y() > 0 ? 1 : -1;
  }
}

std::vector<Isometry3d> CubeHandoverExpert::Meetings(const Isometry3d& rod, int giver, double end) const {
  const Vector3d held = end * rod.linear().col(1);
  // A rod that hangs upright has no heading, because its free end points down.
  const bool is_upright = std::abs(held.z()) > 0.7;
  const double turn = is_upright ? 0 : std::atan2(side_[giver], 0) - std::atan2(held.y(), held.x());
  std::vector<Isometry3d> meetings;
  for (const auto& [x, y, z] : kMiddles) {
    for (double heading : kHeadings) {
      Isometry3d meeting = AngleAxisd(turn + heading, Vector3d::UnitZ()) * rod;
      meeting.translation() = Vector3d(x, y, z);
      meetings.push_back(meeting);
    }
  }
  return meetings;
}

std::optional<Plan> CubeHandoverExpert::HandOver(const Plan& plan, int giver, double end) const {
  const int receiver = 1 - giver;
  std::vector<Grasp> gives;
  for (const double from_middle : kGives) {
    const auto more = BoxGrasps(Part(end * from_middle), plan.PoseOf(rod_), plan.GripPose(giver));
    gives.insert(gives.end(), more.begin(), more.end());
  }
  for (const Grasp& give : gives) {
    Plan taken = plan;
    taken.Take({{giver, rod_, give}}).Lift(rod_, kRodLift).CheckContacts({giver});
    if (!taken.feasible()) continue;
    for (const Isometry3d& meeting : Meetings(taken.PoseOf(rod_), giver, end)) {
      Plan brought = taken;
      brought.Move({{rod_, meeting}}).CheckContacts({0, 1});
      if (!brought.feasible()) continue;
      for (const Grasp& receive : BoxGrasps(Part(-end * kReceive), meeting, plan.GripPose(receiver))) {
        Plan attempt = brought;
        attempt.HandOver(giver, {receiver, rod_, receive}).CheckContacts({0, 1});
        if (attempt.feasible()) return attempt;
      }
    }
  }
  return std::nullopt;
}

std::vector<Motion> CubeHandoverExpert::Next(const Configuration& now, const state_t& state) {
  if (state.header.sim_time_us < kSettledUs) return {};
  Plan start = MakePlan(now, state);
  if (std::vector<int> closed = ClosedGrippers(now); !closed.empty()) return start.Release(closed).motions();
  if (gives_up()) return {};
  ++attempts_;
  const Isometry3d rod = start.PoseOf(rod_);
  // The arm on the rod's side is tried first as the giver. It preferably takes the end on its own side.
  const int nearer = rod.translation().y() * side_[0] >= 0 ? 0 : 1;
  for (int giver : {nearer, 1 - nearer}) {
    const double own = rod.linear()(1, 1) * side_[giver] >= 0 ? 1 : -1;
    for (double end : {own, -own}) {
      if (auto plan = HandOver(start, giver, end)) return plan->motions();
    }
  }
  return {};
}

std::unique_ptr<Expert> MakeCubeHandoverExpert(const mjModel& model, const model_info_t& info) {
  return std::make_unique<CubeHandoverExpert>(model, info);
}

}  // namespace evalbus::policy
