// Scripted expert for StackTwoBlocks. It puts one cube down in the middle and the other cube on top of it. If
// possible, each of two arms takes one cube. Otherwise the cubes are moved in turn, each by an arm that
// reaches it.
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr double kHalfSide = 0.02;  // m
const GraspBox kCube{Vector3d::Constant(kHalfSide)};
// Angles by which hands may lean to reach farther, rad.
const std::vector<double> kHandLeans = {0, 0.35, -0.35};
constexpr double kLift = 0.12;  // m
// Height above its support at which a cube is released.
constexpr double kGap = 0.001;  // m
// Candidate positions of the stack, m. The first position that is free and within reach is used.
constexpr double kSites[][2] = {{0.5, 0},     {0.5, 0.08},  {0.5, -0.08}, {0.42, 0},
                                {0.58, 0},    {0.42, 0.1},  {0.42, -0.1}, {0.5, 0.16},
                                {0.5, -0.16}, {0.58, 0.12}, {0.58, -0.12}};
// Distance that the stack keeps from a cube that is still on the table.
constexpr double kFree = 0.08;  // m

// Returns the heading of a cube that lies flat. The heading is defined up to quarter turns, because all sides
// are equal.
double Heading(const Isometry3d& cube) {
  Eigen::Index flattest = 0;
  cube.linear().row(2).cwiseAbs().minCoeff(&flattest);
  const Vector3d side = cube.linear().col(flattest);
  return std::atan2(side.y(), side.x());
}

// Returns the pose in which `upper` stands flush on top of `lower`.
Isometry3d OnTop(const Isometry3d& lower, const Isometry3d& upper) {
  const double turn = std::remainder(Heading(lower) - Heading(upper), std::numbers::pi / 2);
  Isometry3d pose = AngleAxisd(turn, Vector3d::UnitZ()) * upper;
  pose.translation() = lower.translation() + Vector3d(0, 0, 2 * kHalfSide + kGap);
  return pose;
}

bool IsOn(const Isometry3d& upper, const Isometry3d& lower) {
  const Vector3d offset = upper.translation() - lower.translation();
  return offset.head<2>().norm() < kHalfSide && std::abs(offset.z() - 2 * kHalfSide) < kHalfSide / 2;
}

class StackTwoBlocksExpert : public Expert {
 public:
  // Throws InputError unless the model has red_cube and blue_cube.
  StackTwoBlocksExpert(const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Returns a grasp with which the arm can take and lift the cube after `plan`; nullopt if there is none.
  std::optional<Grasp> FindGrasp(const Plan& plan, int arm, int cube) const;
  // Returns `plan` extended by the motions in which `lower_arm` puts one cube down in the middle while the
  // other arm holds the other cube. The other arm then puts its cube on top. Returns nullopt if this is
  // impossible.
  std::optional<Plan> StackWithBoth(const Plan& plan, int lower_arm, int lower, int upper) const;
  // Returns `plan` extended by the motions that move one cube to the middle, then put the other cube on top
  // of it.
  std::optional<Plan> StackInTurn(const Plan& plan, int lower, int upper) const;
  std::optional<Plan> PutOnTop(const Plan& plan, int lower, int upper) const;

  int cubes_[2];
};

}  // namespace

StackTwoBlocksExpert::StackTwoBlocksExpert(const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/4),
      cubes_{ObjectBody(info, "red_cube"), ObjectBody(info, "blue_cube")} {}

std::optional<Grasp> StackTwoBlocksExpert::FindGrasp(const Plan& plan, int arm, int cube) const {
  for (const Grasp& grasp : BoxGrasps(kCube, plan.PoseOf(cube), plan.GripPose(arm), kHandLeans)) {
    Plan attempt = plan;
    attempt.Take({{arm, cube, grasp}}).Lift(cube, kLift).CheckContacts({arm});
    if (attempt.feasible()) return grasp;
  }
  return std::nullopt;
}

std::optional<Plan> StackTwoBlocksExpert::StackWithBoth(const Plan& plan, int lower_arm, int lower,
                                                        int upper) const {
  const int upper_arm = 1 - lower_arm;
  const auto lower_grasp = FindGrasp(plan, lower_arm, lower);
  const auto upper_grasp = FindGrasp(plan, upper_arm, upper);
  if (!lower_grasp || !upper_grasp) return std::nullopt;
  const Isometry3d on_table = plan.PoseOf(lower);
  const Translation3d up(0, 0, kLift);
  Plan taken = plan;
  taken.Take({{lower_arm, lower, *lower_grasp}, {upper_arm, upper, *upper_grasp}})
      .Move({{lower, up * on_table}, {upper, up * plan.PoseOf(upper)}})
      .CheckContacts(arms_);
  for (const auto& [x, y] : kSites) {
    Isometry3d site = on_table;
    site.translation() = Vector3d(x, y, on_table.translation().z() + kGap);
    Plan attempt = taken;
    attempt.Place(lower, site).Release({lower_arm}).GoHome({lower_arm}).CheckContacts(arms_);
    attempt.Place(upper, OnTop(site, attempt.PoseOf(upper))).Release({upper_arm}).CheckContacts(arms_);
    if (attempt.feasible()) return attempt;
  }
  return std::nullopt;
}

std::optional<Plan> StackTwoBlocksExpert::PutOnTop(const Plan& plan, int lower, int upper) const {
  for (int arm : arms_) {
    const auto grasp = FindGrasp(plan, arm, upper);
    if (!grasp) continue;
    Plan attempt = plan;
    attempt.Take({{arm, upper, *grasp}})
        .Lift(upper, kLift)
        .Place(upper, OnTop(plan.PoseOf(lower), plan.PoseOf(upper)))
        .Release({arm})
        .CheckContacts(arms_);
    if (attempt.feasible()) return attempt;
  }
  return std::nullopt;
}

std::optional<Plan> StackTwoBlocksExpert::StackInTurn(const Plan& plan, int lower, int upper) const {
  const Isometry3d on_table = plan.PoseOf(lower);
  for (int arm : arms_) {
    const auto grasp = FindGrasp(plan, arm, lower);
    if (!grasp) continue;
    Plan taken = plan;
    taken.Take({{arm, lower, *grasp}}).Lift(lower, kLift).CheckContacts(arms_);
    for (const auto& [x, y] : kSites) {
      Isometry3d site = on_table;
      site.translation() = Vector3d(x, y, on_table.translation().z() + kGap);
      if ((site.translation() - plan.PoseOf(upper).translation()).norm() < kFree) continue;
      Plan attempt = taken;
      attempt.Place(lower, site).Release({arm}).GoHome({arm}).CheckContacts(arms_);
      if (!attempt.feasible()) continue;
      if (auto both = PutOnTop(attempt, lower, upper)) return both;
    }
  }
  return std::nullopt;
}

std::vector<Motion> StackTwoBlocksExpert::Next(const Configuration& now, const state_t& state) {
  if (state.header.sim_time_us < kSettledUs) return {};
  const Isometry3d red = BodyPose(state, cubes_[0]), blue = BodyPose(state, cubes_[1]);
  if (IsOn(red, blue) || IsOn(blue, red)) return {};
  Plan start = MakePlan(now, state);
  if (std::vector<int> closed = ClosedGrippers(now); !closed.empty()) return start.Release(closed).motions();
  if (gives_up()) return {};
  ++attempts_;
  if (arms_.size() == 2) {
    for (int arm : arms_) {
      for (int lower : {0, 1}) {
        if (auto plan = StackWithBoth(start, arm, cubes_[lower], cubes_[1 - lower])) return plan->motions();
      }
    }
  }
  for (int lower : {0, 1}) {
    if (auto plan = StackInTurn(start, cubes_[lower], cubes_[1 - lower])) return plan->motions();
  }
  return {};
}

std::unique_ptr<Expert> MakeStackTwoBlocksExpert(const mjModel& model, const model_info_t& info) {
  return std::make_unique<StackTwoBlocksExpert>(model, info);
}

}  // namespace evalbus::policy
