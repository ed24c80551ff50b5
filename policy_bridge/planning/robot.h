// The robot and its surroundings as a scripted policy knows them: kinematics of the arms, where each gripper
// grips, and which configurations touch something.
#pragma once

#include <mujoco/mujoco.h>

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "policy_bridge/planning/kinematics.h"

namespace evalbus::policy {

// What is commanded: one entry per arm and per gripper, in the order of model_info_t.
struct Configuration {
  std::vector<JointVector> joints;  // rad
  std::vector<double> closing;      // 0 open, 1 closed
};

struct Arm {
  ArmChain chain;
  // Grip frame in the wrist frame: origin midway between the pads, z away from the wrist, y the way the pads
  // close.
  Eigen::Isometry3d grip;

  Eigen::Isometry3d GripPose(const JointVector& q) const { return chain.Forward(q) * grip; }
};

// The arms of a model, each with the gripper of the same index. Throws InputError if an arm has none.
std::vector<Arm> MakeArms(const mjModel& model, const model_info_t& info);

// The grippers that are not commanded open.
std::vector<int> ClosedGrippers(const Configuration& configuration);

// Joints of all arms.
size_t CountJoints(const model_info_t& info);

// Home joints, grippers open.
Configuration HomeConfiguration(const model_info_t& info);

// Index of the first body of a named object of the task; its pose in a state. Throws InputError if there is
// no such object, std::runtime_error if the state lacks it.
int ObjectBody(const model_info_t& info, const std::string& object);
Eigen::Isometry3d BodyPose(const state_t& state, int body);

// Index of a body of this name. Throws InputError if there is none.
int BodyId(const mjModel& model, const std::string& name);

// Pose of a site in the frame of a body that it is rigidly attached to. Throws InputError if there is no such
// site.
Eigen::Isometry3d SiteInBody(const mjModel& model, const std::string& site, int body);

// The hinge that a body turns on, in some state.
struct Hinge {
  Eigen::Vector3d point, direction;  // of its axis, world frame; direction is a unit vector
  double angle, lower, upper;        // where the body stands, and the ends of its range, rad
  int qpos;                          // index of the coordinate
};

// Two geoms that are too near to one another; distance in m, negative inside one another.
struct Touch {
  int geom, other;
  double distance;
};

// Answers what the robot would touch, by MuJoCo's collision detection on a private copy of the scene in which
// every geom is thicker by a clearance.
class ContactProbe {
 public:
  ContactProbe(const mjModel& model, const model_info_t& info, double clearance_m);

  // Takes over where everything is. Throws std::runtime_error if the state is not of this model.
  void Set(const state_t& state);
  void SetArm(int arm, const JointVector& q);
  void SetObject(int body, const Eigen::Isometry3d& pose);
  void SetAngle(const Hinge& hinge, double angle);

  // Throws InputError if the body is not on exactly one hinge with a range.
  Hinge HingeOf(int body, const state_t& state) const;

  // What one of these arms (or its hand) touches, if it is anything but the arms that are not named, what
  // pads may touch, which are the objects that these bodies belong to, and its own links that are as near to
  // one another at home.
  std::optional<Touch> FindTouch(const std::vector<int>& arms,
                                 const std::vector<int>& allowed_contact_bodies);

  // "left/link0 is 0.99 mm from left/link1, 3 mm wanted"
  std::string InWords(const Touch& touch) const;

 private:
  // Links that nearly touch at home, as neighbors do.
  void FindNearAtHome(const model_info_t& info);
  std::pair<int, int> BodiesOf(int geom, int other) const;
  void SetMocap(int body, const Eigen::Isometry3d& pose);

  ModelPtr model_;
  DataPtr data_;
  std::vector<std::vector<int>> arm_qpos_;
  // Of each geom: the arm it belongs to or -1, its entity, whether it is a pad.
  std::vector<int> arm_of_geom_, entity_of_geom_;
  std::vector<char> is_pad_;
  std::vector<int> entity_of_body_;
  // Pairs of bodies, the lower index first.
  std::set<std::pair<int, int>> near_at_home_;
  double clearance_;
};

}  // namespace evalbus::policy
