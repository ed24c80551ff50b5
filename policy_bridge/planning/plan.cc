#include "policy_bridge/planning/plan.h"

#include <algorithm>
#include <cmath>

#include "policy_bridge/planning/ik.h"
#include "policy_bridge/planning/min_jerk.h"

namespace evalbus::policy {
namespace {

constexpr double kKnotDistance = 0.04;  // m
constexpr double kKnotTurn = 0.25;      // rad
// If a joint moves farther than this between two knots, the solution has changed its branch.
constexpr double kMaxKnotStep = 0.6;  // rad
constexpr double kMinDuration = 0.3;  // s
// Weight of the home posture in the posture of a redundant arm. The joint positions of the previous knot have
// weight 1 - kHomePull.
constexpr double kHomePull = 0.1;
// Distance between the knots of a motion that is straight in joint space.
constexpr double kJointKnotStep = 0.1;  // rad
// To find other branches of the inverse kinematics, the search also starts from home with one joint turned by
// this angle.
constexpr double kBranchTurn = 1.5;  // rad
// Place() first moves an object to this height above its final pose.
constexpr double kAbove = 0.05;  // m

double Angle(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

Eigen::Isometry3d Between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double s) {
  Eigen::Isometry3d pose;
  pose.makeAffine();
  pose.translation() = (1 - s) * a.translation() + s * b.translation();
  pose.linear() =
      Eigen::Quaterniond(a.linear()).slerp(s, Eigen::Quaterniond(b.linear())).normalized().toRotationMatrix();
  return pose;
}

int NumKnots(double distance, double turn) {
  return 1 + std::max(3, static_cast<int>(std::ceil(std::max(distance / kKnotDistance, turn / kKnotTurn))));
}

double MinDuration(double distance, double speed, double turn, double turn_rate) {
  return std::max(kMinDuration, kMinJerkPeakRate * std::max(distance / speed, turn / turn_rate));
}

// Returns the shortest duration of a path in which no joint is faster than `speed` at any of the sampled
// times.
double JointDuration(const JointPath& path, double speed) {
  double duration = 0;
  const int samples = 4 * static_cast<int>(path.knots().size());
  for (int i = 1; i < samples; ++i) {
    const double t = static_cast<double>(i) / samples;
    duration = std::max(duration, path.Slope(MinJerk(t)).cwiseAbs().maxCoeff() * MinJerkRate(t) / speed);
  }
  return duration;
}

}  // namespace

void Motion::At(double t, Configuration* now) const {
  const double s = duration > 0 ? MinJerk(t / duration) : 1;
  now->joints.resize(paths.size());
  for (size_t i = 0; i < paths.size(); ++i) now->joints[i] = paths[i].At(s);
  now->closing.resize(closing_to.size());
  for (size_t i = 0; i < closing_to.size(); ++i) {
    now->closing[i] = (1 - s) * closing_from[i] + s * closing_to[i];
  }
}

void Motion::VelocityAt(double t, std::vector<JointVector>* velocity) const {
  const double s = duration > 0 ? MinJerk(t / duration) : 1;
  const double rate = duration > 0 ? MinJerkRate(t / duration) / duration : 0;
  velocity->resize(paths.size());
  for (size_t i = 0; i < paths.size(); ++i) (*velocity)[i] = rate * paths[i].Slope(s);
}

PlanningContext::PlanningContext(const mjModel& model, const model_info_t& info,
                                 const MotionLimits& motion_limits)
    : limits(motion_limits),
      arms(MakeArms(model, info)),
      home(HomeConfiguration(info)),
      probe(model, info, motion_limits.clearance) {}

Plan::Plan(PlanningContext* context, const Configuration& now, const state_t& state)
    : context_(context), state_(&state), end_(now), held_(now.joints.size(), -1) {}

Motion Plan::Rest() const {
  Motion rest;
  for (const JointVector& joints : end_.joints) rest.paths.emplace_back(std::vector<JointVector>{joints});
  rest.closing_from = rest.closing_to = end_.closing;
  return rest;
}

void Plan::Append(Motion motion, Contacts contacts) {
  motion.At(motion.duration, &end_);
  motions_.push_back(std::move(motion));
  contacts.allowed_bodies = near_;
  for (int body : held_) {
    if (body >= 0) contacts.allowed_bodies.push_back(body);
  }
  contacts_.push_back(std::move(contacts));
}

Eigen::Isometry3d Plan::PoseOf(int body) const {
  for (const ObjectGoal& moved : moved_) {
    if (moved.body == body) return moved.pose;
  }
  return BodyPose(*state_, body);
}

template <class GripAt>
Plan& Plan::Follow(const std::vector<int>& arms, int knots, double min_duration, const GripAt& grip,
                   Contacts contacts) {
  Motion motion = Rest();
  motion.duration = min_duration;
  for (size_t i = 0; i < arms.size() && feasible_; ++i) {
    const Arm& arm = context_->arms[arms[i]];
    const Eigen::Isometry3d grip_to_wrist = arm.grip.inverse();
    std::vector<JointVector> path{end_.joints[arms[i]]};
    IkOptions options;
    // From one knot to the next, the search converges within a few iterations. If the knot is out of reach,
    // it never converges.
    options.max_iterations = 20;
    for (int k = 1; k < knots; ++k) {
      if (context_->effort_left-- <= 0) {
        feasible_ = false;
        return *this;
      }
      options.posture = (1 - kHomePull) * path.back() + kHomePull * context_->home.joints[arms[i]];
      const IkResult ik = SolveIk(arm.chain, grip(i, static_cast<double>(k) / (knots - 1)) * grip_to_wrist,
                                  path.back(), options);
      if (!ik.converged || (ik.joints - path.back()).cwiseAbs().maxCoeff() > kMaxKnotStep) {
        // The goal of the motion is reported, because it is more informative than the knot at which the
        // search failed.
        context_->Note(motions_.size(), {.touch = {}, .arm = arms[i], .grip = grip(i, 1.0).translation()});
        feasible_ = false;
        return *this;
      }
      path.push_back(ik.joints);
    }
    motion.paths[arms[i]] = JointPath(std::move(path));
    motion.duration =
        std::max(motion.duration, JointDuration(motion.paths[arms[i]], context_->limits.joint_speed));
  }
  if (feasible_) Append(std::move(motion), std::move(contacts));
  return *this;
}

Plan& Plan::GoStraight(const std::vector<GripGoal>& goals, double speed) {
  if (!feasible_) return *this;
  std::vector<int> arms;
  std::vector<Eigen::Isometry3d> starts;
  double distance = 0, turn = 0;
  for (const GripGoal& goal : goals) {
    arms.push_back(goal.arm);
    starts.push_back(GripPose(goal.arm));
    distance = std::max(distance, (goal.pose.translation() - starts.back().translation()).norm());
    turn = std::max(turn, Angle(starts.back(), goal.pose));
  }
  return Follow(arms, NumKnots(distance, turn),
                MinDuration(distance, speed, turn, context_->limits.grip_turn_rate),
                [&](size_t i, double s) { return Between(starts[i], goals[i].pose, s); }, {});
}

Plan& Plan::GoStraightInJoints(const std::vector<int>& arms, const std::vector<JointVector>& goals) {
  if (!feasible_) return *this;
  Motion motion = Rest();
  motion.duration = kMinDuration;
  for (size_t i = 0; i < arms.size(); ++i) {
    const JointVector &from = end_.joints[arms[i]], &to = goals[i];
    // There are enough knots to detect obstacles along the path.
    const int spans = 1 + static_cast<int>((to - from).cwiseAbs().maxCoeff() / kJointKnotStep);
    std::vector<JointVector> way;
    for (int k = 0; k <= spans; ++k) {
      const double s = static_cast<double>(k) / spans;
      way.push_back((1 - s) * from + s * to);
    }
    motion.paths[arms[i]] = JointPath(std::move(way));
    motion.duration =
        std::max(motion.duration, JointDuration(motion.paths[arms[i]], context_->limits.joint_speed));
  }
  Append(std::move(motion), {});
  return *this;
}

Plan& Plan::GoHome(const std::vector<int>& arms) {
  std::vector<JointVector> goals;
  for (int arm : arms) goals.push_back(context_->home.joints[arm]);
  return GoStraightInJoints(arms, goals);
}

Plan& Plan::Swing(const std::vector<GripGoal>& goals) {
  if (!feasible_) return *this;
  std::vector<int> arms;
  std::vector<JointVector> nearest;
  for (const GripGoal& goal : goals) {
    const Arm& arm = context_->arms[goal.arm];
    const JointVector &now = end_.joints[goal.arm], &home = context_->home.joints[goal.arm];
    std::vector<JointVector> starts{now, home};
    for (Eigen::Index joint = 0; joint < home.size(); ++joint) {
      for (double turn : {kBranchTurn, -kBranchTurn}) {
        starts.push_back(home);
        starts.back()[joint] += turn;
      }
    }
    const auto way = [&](const JointVector& joints) { return (joints - now).cwiseAbs().maxCoeff(); };
    bool found = false;
    for (const JointVector& start : starts) {
      if (context_->effort_left-- <= 0) break;
      const IkResult ik = SolveIk(arm.chain, goal.pose * arm.grip.inverse(), start);
      if (!ik.converged || (found && way(ik.joints) >= way(nearest.back()))) continue;
      if (found) nearest.pop_back();
      nearest.push_back(ik.joints);
      found = true;
    }
    if (!found) {
      context_->Note(motions_.size(), {.touch = {}, .arm = goal.arm, .grip = goal.pose.translation()});
      feasible_ = false;
      return *this;
    }
    arms.push_back(goal.arm);
  }
  return GoStraightInJoints(arms, nearest);
}

Plan& Plan::MoveGrippers(const std::vector<int>& grippers, double closing) {
  if (!feasible_) return *this;
  Motion motion = Rest();
  motion.duration = context_->limits.gripper_time;
  for (int gripper : grippers) motion.closing_to[gripper] = closing;
  Append(std::move(motion), {});
  return *this;
}

void Plan::SetPose(const ObjectGoal& object) {
  std::erase_if(moved_, [&](const ObjectGoal& moved) { return moved.body == object.body; });
  moved_.push_back(object);
}

Plan& Plan::Press(int body, const std::vector<GripGoal>& goals) {
  for (const GripGoal& goal : goals) held_[goal.arm] = body;
  return Approach(goals);
}

Plan& Plan::Drag(int body, const Eigen::Isometry3d& pose) {
  return Carry({{body, pose}}, context_->limits.push_speed);
}

Plan& Plan::Turn(const std::vector<Turning>& turnings, double speed) {
  if (!feasible_) return *this;
  std::vector<int> arms;
  std::vector<Hinge> hinges;
  std::vector<Eigen::Isometry3d> starts;
  Contacts contacts;
  double distance = 0, turn = 0;
  for (const Turning& turning : turnings) {
    Hinge hinge = context_->probe.HingeOf(turning.body, *state_);
    for (const Contacts& earlier : contacts_) {
      for (const Turned& turned : earlier.turned) {
        if (turned.hinge.qpos == hinge.qpos) hinge.angle = turned.to;
      }
    }
    arms.push_back(turning.arm);
    hinges.push_back(hinge);
    starts.push_back(GripPose(turning.arm));
    contacts.turned.push_back({hinge, hinge.angle + turning.angle - turning.slack});
    near_.push_back(turning.body);
    const Eigen::Vector3d lever = starts.back().translation() - hinge.point;
    distance = std::max(distance, std::abs(turning.angle) * hinge.direction.cross(lever).norm());
    turn = std::max(turn, std::abs(turning.angle));
  }
  const auto turned = [&](size_t i, double s) {
    const auto turn_by = [&](double angle) { return Eigen::AngleAxisd(angle, hinges[i].direction); };
    const double angle = s * turnings[i].angle;
    Eigen::Isometry3d grip = starts[i];
    grip.linear() = (turn_by(turnings[i].follow * angle) * starts[i].linear()).eval();
    grip.translation() = hinges[i].point + turn_by(angle) * (starts[i].translation() - hinges[i].point);
    return grip;
  };
  Follow(arms, NumKnots(distance, turn), MinDuration(distance, speed, turn, context_->limits.grip_turn_rate),
         turned, std::move(contacts));
  near_.clear();
  return *this;
}

Plan& Plan::Open(const std::vector<int>& grippers) {
  for (int gripper : grippers) held_[gripper] = -1;
  return MoveGrippers(grippers, 0);
}

Plan& Plan::OpenMeanwhile(const std::vector<int>& grippers) {
  if (!feasible_) return *this;
  for (int gripper : grippers) held_[gripper] = -1;
  for (int gripper : grippers) motions_.back().closing_to[gripper] = end_.closing[gripper] = 0;
  return *this;
}

Plan& Plan::Take(const std::vector<Hold>& holds) {
  std::vector<int> arms;
  std::vector<GripGoal> before, at;
  for (const Hold& hold : holds) {
    const Eigen::Isometry3d object = PoseOf(hold.body);
    arms.push_back(hold.arm);
    before.push_back({hold.arm, object * hold.grasp.before});
    at.push_back({hold.arm, object * hold.grasp.at});
  }
  Reach(before);
  for (const Hold& hold : holds) near_.push_back(hold.body);
  Approach(at).Close(arms);
  near_.clear();
  for (const Hold& hold : holds) held_[hold.arm] = hold.body;
  return *this;
}

Plan& Plan::Carry(int body, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                  const std::vector<int>& arms) {
  for (int arm : arms) held_[arm] = body;
  SetPose({body, from});
  return Move({{body, to}});
}

Plan& Plan::Carry(const std::vector<ObjectGoal>& goals, double speed) {
  if (!feasible_) return *this;
  std::vector<int> arms;
  // For each entry of `arms`: index in `goals` of the object that the arm carries, and the arm's grip in the
  // object's frame.
  std::vector<size_t> carries;
  std::vector<Eigen::Isometry3d> in_object;
  Contacts contacts;
  double distance = 0, turn = 0;
  for (size_t i = 0; i < goals.size(); ++i) {
    const Eigen::Isometry3d from = PoseOf(goals[i].body), &to = goals[i].pose;
    contacts.carried.push_back({goals[i].body, from, to});
    turn = std::max(turn, Angle(from, to));
    for (size_t arm = 0; arm < held_.size(); ++arm) {
      if (held_[arm] != goals[i].body) continue;
      const Eigen::Isometry3d grip = GripPose(static_cast<int>(arm));
      arms.push_back(static_cast<int>(arm));
      carries.push_back(i);
      in_object.push_back(from.inverse() * grip);
      distance = std::max(distance, ((to * in_object.back()).translation() - grip.translation()).norm());
    }
    SetPose(goals[i]);
  }
  const std::vector<Carried> carried = contacts.carried;
  return Follow(
      arms, NumKnots(distance, turn), MinDuration(distance, speed, turn, context_->limits.grip_turn_rate),
      [&](size_t i, double s) {
        return Between(carried[carries[i]].from, carried[carries[i]].to, s) * in_object[i];
      },
      std::move(contacts));
}

Plan& Plan::Lift(int body, double height) {
  return Move({{body, Eigen::Translation3d(0, 0, height) * PoseOf(body)}});
}

Plan& Plan::Place(int body, const Eigen::Isometry3d& pose) {
  return Move({{body, Eigen::Translation3d(0, 0, kAbove) * pose}})
      .Carry({{body, pose}}, context_->limits.approach_speed);
}

Plan& Plan::Release(const std::vector<int>& arms) {
  std::vector<GripGoal> back;
  for (int arm : arms) {
    back.push_back({arm, GripPose(arm) * Eigen::Translation3d(0, 0, -kGraspApproach)});
    if (held_[arm] >= 0) near_.push_back(held_[arm]);
  }
  Open(arms).Approach(back);
  near_.clear();
  return *this;
}

Plan& Plan::CheckContacts(const std::vector<int>& arms) {
  if (!feasible_) return *this;
  ContactProbe& probe = context_->probe;
  probe.Set(*state_);
  for (size_t i = 0; i < motions_.size(); ++i) {
    const Motion& motion = motions_[i];
    const Contacts& contacts = contacts_[i];
    if (i < num_checked_) {
      for (const Carried& carried : contacts.carried) probe.SetObject(carried.body, carried.to);
      for (const Turned& turned : contacts.turned) probe.SetAngle(turned.hinge, turned.to);
      continue;
    }
    size_t spans = 0;
    for (const JointPath& path : motion.paths) spans = std::max(spans, path.knots().size() - 1);
    for (size_t k = 1; k <= spans; ++k) {
      const double s = static_cast<double>(k) / static_cast<double>(spans);
      for (size_t arm = 0; arm < motion.paths.size(); ++arm)
        probe.SetArm(static_cast<int>(arm), motion.paths[arm].At(s));
      for (const Carried& carried : contacts.carried) {
        probe.SetObject(carried.body, Between(carried.from, carried.to, s));
      }
      for (const Turned& turned : contacts.turned) {
        probe.SetAngle(turned.hinge, (1 - s) * turned.hinge.angle + s * turned.to);
      }
      if (context_->effort_left-- <= 0) {
        feasible_ = false;
        return *this;
      }
      if (const auto touch = probe.FindTouch(arms, contacts.allowed_bodies)) {
        context_->Note(i, {.touch = touch});
        feasible_ = false;
        return *this;
      }
    }
  }
  num_checked_ = motions_.size();
  return *this;
}

void Player::Reset(const Configuration& rest) {
  motions_.clear();
  started_ = now_ = 0;
  commanded_ = rest;
}

void Player::Start(std::vector<Motion> motions, double time) {
  motions_ = std::move(motions);
  started_ = time;
}

const Configuration& Player::At(double time) {
  now_ = time;
  while (!motions_.empty() && time - started_ >= motions_.front().duration) {
    motions_.front().At(motions_.front().duration, &commanded_);
    started_ += motions_.front().duration;
    motions_.erase(motions_.begin());
  }
  if (!motions_.empty()) motions_.front().At(time - started_, &commanded_);
  return commanded_;
}

const std::vector<JointVector>& Player::Velocity() {
  if (!motions_.empty()) {
    motions_.front().VelocityAt(now_ - started_, &velocity_);
  } else {
    velocity_.resize(commanded_.joints.size());
    for (size_t i = 0; i < velocity_.size(); ++i) velocity_[i].setZero(commanded_.joints[i].size());
  }
  return velocity_;
}

}  // namespace evalbus::policy
