// Motion primitives. A scripted expert is a short list of them:
//
//   Plan plan(&context, now, state);
//   plan.Take({{kLeft, cube, grasp}}).Lift(cube, 0.1).Place(cube, there).Release({kLeft}).GoHome({kLeft});
//
// A plan is computed completely before it is executed. The grip frames move along straight lines and arcs,
// except that Swing() and GoHome() move the arms straight in joint space. Joint positions are computed at
// knots of these paths, and timed so that no joint and, on lines and arcs, no hand exceeds its speed limit. A
// plan reports whether it is feasible, so an expert can try several plans in turn.
#pragma once

#include <optional>
#include <vector>

#include "policy_bridge/planning/grasp.h"
#include "policy_bridge/planning/joint_path.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

struct MotionLimits {
  double joint_speed = 1.1;     // rad/s
  double grip_speed = 0.6;      // m/s
  double approach_speed = 0.2;  // m/s
  double carry_speed = 0.3;     // m/s
  double push_speed = 0.1;      // m/s
  double grip_turn_rate = 2.0;  // rad/s
  double gripper_time = 0.6;    // s, to open or close
  double clearance = 0.003;     // m, from everything that the robot must not touch
};

// Minimum-jerk motion of all arms and grippers from one configuration to another.
struct Motion {
  double duration = 0;           // s
  std::vector<JointPath> paths;  // one per arm
  std::vector<double> closing_from, closing_to;

  // Writes the configuration after t seconds to *now. t is clamped to the motion's duration.
  void At(double t, Configuration* now) const;
  // Writes the joint velocities (rad/s) after t seconds to *velocity, one entry per arm.
  void VelocityAt(double t, std::vector<JointVector>* velocity) const;
};

// Goal of a gripper: the pose of its grip frame in the world frame.
struct GripGoal {
  int arm;
  Eigen::Isometry3d pose;
};

// Goal of an object: the pose of its first body in the world frame.
struct ObjectGoal {
  int body;
  Eigen::Isometry3d pose;
};

// An arm, the object that it grasps, and the grasp.
struct Hold {
  int arm;
  int body;
  Grasp grasp;
};

// An arm and the body that it turns on its hinge. Angles are in rad, and positive in the hinge's direction.
struct Turning {
  int arm;
  int body;
  double angle;       // rotation of the grip about the hinge
  double follow = 1;  // fraction of the angle by which the hand itself rotates
  double slack = 0;   // part of the angle before the grip touches the body and starts to turn it
};

// Reason why a plan is infeasible: a contact, or a grip position that an arm cannot reach.
struct Obstacle {
  std::optional<Touch> touch;
  int arm = -1;                                    // set if there is no touch
  Eigen::Vector3d grip = Eigen::Vector3d::Zero();  // m, the goal not reached
};

// Data about the model that all plans share. It is created once per run.
struct PlanningContext {
  PlanningContext(const mjModel& model, const model_info_t& info, const MotionLimits& limits = {});

  MotionLimits limits;
  std::vector<Arm> arms;
  Configuration home;
  ContactProbe probe;
  static constexpr int kEffort = 3'000;
  // Remaining planning budget of the tick. Each solution of the inverse kinematics (about 2 microseconds) and
  // each check of a knot for contacts (about 20 microseconds) costs 1. At 0, arm motions are infeasible.
  // Expert::Act() resets it to kEffort before it calls Next(), which bounds the computing time of a tick.
  int effort_left = kEffort;

  // Obstacle of the infeasible plan that got farthest (had the most motions) since `obstacle` was cleared,
  // and its number of motions.
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
  // Creates a plan that starts at the commanded configuration `now`. All other bodies have their poses in
  // `state`.
  Plan(PlanningContext* context, const Configuration& now, const state_t& state);

  // Each primitive appends motions. Once one is impossible, the plan is infeasible and later primitives do
  // nothing. Arms and grippers that are not named stay where they are.

  // Moves the grips straight to their goals.
  Plan& Reach(const std::vector<GripGoal>& goals) { return GoStraight(goals, context_->limits.grip_speed); }
  // Moves the grips slowly and straight to their goals: for the last centimeters to a grasp, and the first
  // centimeters away from it.
  Plan& Approach(const std::vector<GripGoal>& goals) {
    return GoStraight(goals, context_->limits.approach_speed);
  }
  // Approaches an object that rests on a support. The pads may touch the object, and Drag can then move it.
  Plan& Press(int body, const std::vector<GripGoal>& goals);
  // Slides an object along its support to a pose, with the arms that press on the object.
  Plan& Drag(int body, const Eigen::Isometry3d& pose);
  // Moves the grips along arcs about the hinges of bodies, to turn a wheel or push a lid. The bodies turn
  // with the grips, from their angles in the state or after the last Turn. Pads may touch these bodies.
  Plan& Turn(const std::vector<Turning>& turnings, double speed);
  // Moves the grips to their goals, straight in joint space. The joint positions that are nearest to the
  // current ones are used. This is for large rotations of a hand, which are impossible on a straight line of
  // the grip.
  Plan& Swing(const std::vector<GripGoal>& goals);
  // Moves the arms home, straight in joint space.
  Plan& GoHome(const std::vector<int>& arms);
  // Opens the grippers, which releases the objects that they hold.
  Plan& Open(const std::vector<int>& grippers);
  // Opens the grippers during the last motion instead of after it.
  Plan& OpenMeanwhile(const std::vector<int>& grippers);
  Plan& Close(const std::vector<int>& grippers) { return MoveGrippers(grippers, 1); }

  // Each arm reaches for its object, approaches it and closes its gripper. It then holds the object.
  Plan& Take(const std::vector<Hold>& holds);
  // Moves the objects straight to their goals, each carried by the arms that hold it.
  Plan& Move(const std::vector<ObjectGoal>& goals) { return Carry(goals, context_->limits.carry_speed); }
  // Moves one object that these arms have closed on without Take. from: the object's assumed pose.
  Plan& Carry(int body, const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
              const std::vector<int>& arms);
  // Lifts an object straight up by `height` (m).
  Plan& Lift(int body, double height);
  // Places an object at a pose on a support: moves it above the pose, then slowly down.
  Plan& Place(int body, const Eigen::Isometry3d& pose);
  // Opens the grippers, which releases the objects that they hold, and moves them back along their own axes.
  Plan& Release(const std::vector<int>& arms);
  // Passes an object to another arm: the other arm grasps the object before `giver` releases it.
  Plan& HandOver(int giver, const Hold& receiver) { return Take({receiver}).Release({giver}); }

  // Makes the plan infeasible if one of these arms touches anything in the motions since the last check. Only
  // the knots of the motions are checked. Contacts with other arms are ignored, and pads may touch objects
  // that are being grasped or held.
  Plan& CheckContacts(const std::vector<int>& arms);

  // Returns the pose of a body at the end of the plan. If the plan does not move the body, this is its pose
  // in the state.
  Eigen::Isometry3d PoseOf(int body) const;
  // Returns the pose of a grip at the end of the plan.
  Eigen::Isometry3d GripPose(int arm) const { return context_->arms[arm].GripPose(end_.joints[arm]); }
  bool feasible() const { return feasible_; }
  const std::vector<Motion>& motions() const { return motions_; }
  // Returns the configuration at the end of the plan.
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
  // Data about a motion that CheckContacts needs.
  struct Contacts {
    std::vector<Carried> carried;
    std::vector<Turned> turned;
    // Bodies that pads may touch.
    std::vector<int> allowed_bodies;
  };
  // grip(i, s): pose of the grip of arms[i] at fraction s of the motion.
  template <class GripAt>
  Plan& Follow(const std::vector<int>& arms, int knots, double min_duration, const GripAt& grip,
               Contacts contacts);
  Plan& GoStraight(const std::vector<GripGoal>& goals, double speed);
  Plan& Carry(const std::vector<ObjectGoal>& goals, double speed);
  // goals: joint positions, one entry for each of these arms.
  Plan& GoStraightInJoints(const std::vector<int>& arms, const std::vector<JointVector>& goals);
  Plan& MoveGrippers(const std::vector<int>& grippers, double closing);
  void SetPose(const ObjectGoal& object);
  Motion Rest() const;
  void Append(Motion motion, Contacts contacts);

  PlanningContext* context_;
  const state_t* state_;
  Configuration end_;
  std::vector<Motion> motions_;
  // One entry per motion.
  std::vector<Contacts> contacts_;
  // moved_: objects that the plan has moved, with their last poses. held_: for each arm, the object that it
  // holds, or -1.
  std::vector<ObjectGoal> moved_;
  std::vector<int> held_;
  // Objects that pads may touch although no arm holds them, because they are being grasped or have just been
  // released.
  std::vector<int> near_;
  // Number of motions already checked for contacts.
  size_t num_checked_ = 0;
  bool feasible_ = true;
};

// Executes motions in sequence.
class Player {
 public:
  // Discards all motions. The player then rests in this configuration, starting at time 0.
  void Reset(const Configuration& rest);
  // Executes these motions, beginning at `time` (s).
  void Start(std::vector<Motion> motions, double time);
  // Returns the commanded configuration at `time`. Times must not decrease.
  const Configuration& At(double time);
  // Returns the joint velocities at the time of the last At(), rad/s, one entry per arm.
  const std::vector<JointVector>& Velocity();
  // Returns true if all motions had ended by the time of the last At().
  bool done() const { return motions_.empty(); }

 private:
  std::vector<Motion> motions_;  // the first is being executed
  double started_ = 0;
  double now_ = 0;
  Configuration commanded_;
  std::vector<JointVector> velocity_;
};

}  // namespace evalbus::policy
