// Motion primitives, from which a scripted expert is written as a short list:
//
//   Plan plan(&context, now, state);
//   plan.Take({{kLeft, cube, grasp}}).Lift(cube, 0.1).Place(cube, there).Release({kLeft}).GoHome({kLeft});
//
// A plan is made before it is carried out: straight lines and arcs of the grip frames, solved for joint
// positions at knots, timed so that no joint and no hand exceeds its speed. It is feasible or not, so an
// expert can try one after the other.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/planning/grasp.h"
#include "policy_bridge/planning/joint_path.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

struct MotionLimits {
  // Also the wrist's: 12 N m against a joint damping of 10 N m s/rad allow no more than 1.2 rad/s.
  double joint_speed = 1.1;     // rad/s
  double grip_speed = 0.6;      // m/s
  double approach_speed = 0.2;  // m/s
  double carry_speed = 0.3;     // m/s
  double push_speed = 0.1;      // m/s
  double grip_turn_rate = 2.0;  // rad/s
  double gripper_time = 0.6;    // s, to open or close
  double clearance = 0.003;     // m, to everything the robot should not touch
};

// Minimum-jerk motion of all arms and grippers from one configuration to another.
struct Motion {
  double duration = 0;           // s
  std::vector<JointPath> paths;  // one per arm
  std::vector<double> closing_from, closing_to;

  // After t seconds; t is clamped to the motion. Into the storage of `now`.
  void At(double t, Configuration* now) const;
};

// A gripper's goal, as the pose of its grip frame in the world.
struct GripGoal {
  int arm;
  Eigen::Isometry3d pose;
};

// An object's goal, as the pose of its first body in the world.
struct ObjectGoal {
  int body;
  Eigen::Isometry3d pose;
};

// An arm that is to take an object, and how.
struct Hold {
  int arm;
  int body;
  Grasp grasp;
};

// An arm that is to turn a body on its hinge, and how; angles in rad, in the sense of the hinge.
struct Turning {
  int arm;
  int body;
  double angle;       // of the grip about the hinge
  double follow = 1;  // the hand itself turns by this fraction of it
  double slack = 0;   // of the angle: until the grip meets the body and takes it along
};

// Why a plan cannot be: something is in the way, or a grip does not get where it should.
struct Obstacle {
  std::optional<Touch> touch;
  int arm = -1;                                    // where there is no touch
  Eigen::Vector3d grip = Eigen::Vector3d::Zero();  // m
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

  // Of the plans since it was cleared: what ended the one that came farthest, and after how many motions.
  std::optional<Obstacle> obstacle;
  size_t motions_before_obstacle = 0;
  void Note(size_t motions, const Obstacle& found) {
    if (obstacle && motions <= motions_before_obstacle) return;
    obstacle = found;
    motions_before_obstacle = motions;
  }
};

class Plan {
 public:
  // From what is commanded now, with everything else where `state` says.
  Plan(PlanningContext* context, const Configuration& now, const state_t& state);

  // Each primitive appends motions. Once one is impossible the plan is infeasible and the rest do nothing.
  // Arms and grippers that are not named rest.

  // The grips go straight to their goals.
  Plan& Reach(const std::vector<GripGoal>& goals) { return GoStraight(goals, context_->limits.grip_speed); }
  // The same slowly: the last centimeters to a grasp, and the first ones away from it.
  Plan& Approach(const std::vector<GripGoal>& goals) {
    return GoStraight(goals, context_->limits.approach_speed);
  }
  // As Approach, down on an object whose support is below it: pads may touch it, and Drag then takes it
  // along.
  Plan& Press(int body, const std::vector<GripGoal>& goals);
  // The arms that press on an object slide it along its support to a pose.
  Plan& Drag(int body, const Eigen::Isometry3d& pose);
  // The grips go along arcs about the hinges of bodies, as a hand does that turns a wheel or pushes a lid,
  // and take these bodies along from where they are in the state. Pads may touch them.
  Plan& Turn(const std::vector<Turning>& turnings, double speed);
  // The grips come to their goals straight in joint space, to the solutions nearest to where the joints are:
  // for a large turn of a hand, which a straight line of the grip does not allow.
  Plan& Swing(const std::vector<GripGoal>& goals);
  // The arms go home, straight in joint space.
  Plan& GoHome(const std::vector<int>& arms);
  // Lets go what the grippers hold.
  Plan& Open(const std::vector<int>& grippers);
  // The same, but during the last motion instead of after it.
  Plan& OpenMeanwhile(const std::vector<int>& grippers);
  Plan& Close(const std::vector<int>& grippers) { return MoveGrippers(grippers, 1); }

  // The arms reach for their objects, approach and close: they hold them from then on.
  Plan& Take(const std::vector<Hold>& holds);
  // The objects go straight to their goals, each in the hands of the arms that hold it.
  Plan& Move(const std::vector<ObjectGoal>& goals) { return Carry(goals, context_->limits.carry_speed); }
  // The same for one object that these arms have closed on without Take, and from where it is taken to be.
  Plan& Carry(int body, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
              const std::vector<int>& arms);
  // Straight up by `height` (m).
  Plan& Lift(int body, double height);
  // To a pose on a support: first above it, then slowly down.
  Plan& Place(int body, const Eigen::Isometry3d& pose);
  // The grippers open, let go what they hold and back off along their own axes.
  Plan& Release(const std::vector<int>& arms);
  // Another arm takes the object before the one that holds it lets it go.
  Plan& HandOver(int giver, const Hold& receiver) { return Take({receiver}).Release({giver}); }

  // Infeasible if these arms touch anything but arms not named, in the motions since the last check. Pads may
  // touch what is taken or held. Looks at the knots.
  Plan& CheckContacts(const std::vector<int>& arms);

  // Where the plan leaves a body: as in the state, unless it moved it.
  Eigen::Isometry3d PoseOf(int body) const;
  // Where the plan leaves a grip.
  Eigen::Isometry3d GripPose(int arm) const { return context_->arms[arm].GripPose(end_.joints[arm]); }
  bool feasible() const { return feasible_; }
  const std::vector<Motion>& motions() const { return motions_; }
  // Where the plan ends.
  const Configuration& end() const { return end_; }

 private:
  struct Carried {
    int body;
    Eigen::Isometry3d from, to;
  };
  struct Turned {
    Hinge hinge;
    double to;
  };
  // What CheckContacts needs to know of a motion.
  struct Contacts {
    std::vector<Carried> carried;
    std::vector<Turned> turned;
    // Bodies that pads may touch.
    std::vector<int> allowed_bodies;
  };
  // grip(i, s): pose of the grip of arms[i] at fraction s.
  template <class GripAt>
  Plan& Follow(const std::vector<int>& arms, int knots, double min_duration, const GripAt& grip,
               Contacts contacts);
  Plan& GoStraight(const std::vector<GripGoal>& goals, double speed);
  Plan& Carry(const std::vector<ObjectGoal>& goals, double speed);
  // goals: joint positions, one for each of these arms.
  Plan& GoStraightInJoints(const std::vector<int>& arms, const std::vector<JointVector>& goals);
  Plan& MoveGrippers(const std::vector<int>& grippers, double closing);
  void SetPose(const ObjectGoal& object);
  Motion Rest() const;
  void Append(Motion motion, Contacts contacts);

  PlanningContext* context_;
  const state_t* state_;
  Configuration end_;
  std::vector<Motion> motions_;
  // Of each motion.
  std::vector<Contacts> contacts_;
  // Objects where the plan left them, and of each arm the one that it holds, -1 for none.
  std::vector<ObjectGoal> moved_;
  std::vector<int> held_;
  // Pads may touch these, too, though nobody holds them: what is being taken or was just released.
  std::vector<int> near_;
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

}  // namespace evalbus::policy
