// Motion primitives, from which a scripted expert is written as a short list:
//
//   Plan plan(&context, now, state);
//   plan.Reach(above_handles).Approach(handles).Close({0, 1}).Carry(body, from, to, {0, 1});
//
// A plan is made before it is carried out: straight lines of the grip frames, solved for joint positions at
// knots, timed so that no joint and no hand exceeds its speed. It is feasible or not, so an expert can try
// one after the other.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/joint_path.h"
#include "policy_bridge/robot.h"

namespace evalbus {

struct MotionLimits {
  // Also the wrist's: 12 N m against a joint damping of 10 N m s/rad allow no more than 1.2 rad/s.
  double joint_speed = 1.1;     // rad/s
  double grip_speed = 0.6;      // m/s
  double approach_speed = 0.2;  // m/s
  double carry_speed = 0.3;     // m/s
  double grip_turn_rate = 2.0;  // rad/s
  double gripper_time = 0.6;    // s, to open or close
  double clearance = 0.003;     // m, to everything the robot should not touch
};

// Minimum-jerk motion of all arms and grippers from one configuration to another.
struct Motion {
  double duration = 0;           // s
  std::vector<JointPath> paths;  // one per arm
  std::vector<double> closing_from, closing_to;

  // After t seconds; t is clamped to the motion.
  Configuration At(double t) const;
};

// A gripper's goal, as the pose of its grip frame in the world.
struct GripGoal {
  int arm;
  Eigen::Isometry3d pose;
};

// What plans need of the model; made once per run.
struct PlanningContext {
  PlanningContext(const mjModel& model, const model_info_t& info, const MotionLimits& limits = {});

  MotionLimits limits;
  std::vector<Arm> arms;
  Configuration home;
  ContactProbe probe;
  // Knots that may still be solved or checked for contacts (2 and 20 microseconds each); then every plan is
  // infeasible. An Expert gets kEffort anew each time that it is asked, so that no state makes it think for
  // long.
  static constexpr int kEffort = 3'000;
  int effort_left = kEffort;
};

class Plan {
 public:
  // From what is commanded now, with everything else where `state` says.
  Plan(PlanningContext* context, const Configuration& now, const state_t& state);

  // Each primitive appends a motion. Once one is impossible the plan is infeasible and the rest do nothing.

  // The grips go straight to their goals, the other arms rest.
  Plan& Reach(const std::vector<GripGoal>& goals) { return GoStraight(goals, context_->limits.grip_speed); }
  // The same slowly: the last centimetres to a grasp, and the first ones away from it.
  Plan& Approach(const std::vector<GripGoal>& goals) {
    return GoStraight(goals, context_->limits.approach_speed);
  }
  // The arms go home, straight in joint space.
  Plan& GoHome(const std::vector<int>& arms);
  Plan& Open(const std::vector<int>& grippers) { return MoveGrippers(grippers, 0); }
  Plan& Close(const std::vector<int>& grippers) { return MoveGrippers(grippers, 1); }
  // The arms, which hold the object whose first body is `body`, bring it straight from one pose to another.
  Plan& Carry(int body, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
              const std::vector<int>& arms);

  // Infeasible if these arms touch anything but arms not named, in the motions since the last check. Pads may
  // touch what is carried. Looks at the knots.
  Plan& CheckContacts(const std::vector<int>& arms);

  bool feasible() const { return feasible_; }
  const std::vector<Motion>& motions() const { return motions_; }
  // Where the plan ends.
  const Configuration& end() const { return end_; }

 private:
  struct Carried {
    int body = -1;
    Eigen::Isometry3d from, to;
  };
  // grip(i, s): pose of the grip of arms[i] at fraction s.
  template <class GripAt>
  Plan& Follow(const std::vector<int>& arms, int knots, double min_duration, const GripAt& grip,
               const Carried& carried);
  Plan& GoStraight(const std::vector<GripGoal>& goals, double speed);
  Plan& MoveGrippers(const std::vector<int>& grippers, double closing);
  Motion Rest() const;
  void Append(Motion motion, const Carried& carried);

  PlanningContext* context_;
  const state_t* state_;
  Configuration end_;
  std::vector<Motion> motions_;
  // Of each motion: what it carries.
  std::vector<Carried> carried_;
  // Motions checked for contacts so far.
  size_t num_checked_ = 0;
  bool feasible_ = true;
};

// Carries out motions, one after the other.
class Player {
 public:
  // At rest in a configuration at time 0.
  void Reset(const Configuration& rest);
  // Continues with these motions from `time` (s) on.
  void Start(std::vector<Motion> motions, double time);
  // Commanded configuration. Times must not decrease.
  const Configuration& At(double time);
  // True once all motions have ended by the last time asked for.
  bool done() const { return motions_.empty(); }

 private:
  std::vector<Motion> motions_;  // the first is under way
  double started_ = 0;
  Configuration commanded_;
};

}  // namespace evalbus
