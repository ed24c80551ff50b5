// The robot and its surroundings, for scripted policies: kinematics of the arms, grip frames, and contacts in
// a given configuration.
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

// Commanded configuration: one entry per arm and per gripper, in the order of model_info_t.
struct Configuration {
  std::vector<JointVector> joints;  // rad
  std::vector<double> closing;      // 0 open, 1 closed
};

struct Arm {
  ArmChain chain;
  // Grip frame in the wrist frame: origin midway between the pads, z away from the wrist, y in the direction
  // in which the pads close.
  Eigen::Isometry3d grip;

  Eigen::Isometry3d GripPose(const JointVector& q) const { return chain.Forward(q) * grip; }
};

// Returns the arms of a model, each with the gripper of the same index. Throws InputError if an arm has no
// gripper, or if a gripper does not have two fingers with pads.
std::vector<Arm> MakeArms(const mjModel& model, const model_info_t& info);

// Returns the indices of the grippers that are not commanded open.
std::vector<int> ClosedGrippers(const Configuration& configuration);

// Returns the total number of joints of all arms.
size_t CountJoints(const model_info_t& info);

// Returns the configuration with all arms at home and all grippers open.
Configuration HomeConfiguration(const model_info_t& info);

// ObjectBody() returns the index of the first body of an object of the task, and throws InputError if there
// is no object of this name. BodyPose() returns the pose of a body, and throws std::runtime_error if the
// state lacks the body.
int ObjectBody(const model_info_t& info, const std::string& object);
Eigen::Isometry3d BodyPose(const state_t& state, int body);

// Returns the index of the body with this name. Throws InputError if there is none.
int BodyId(const mjModel& model, const std::string& name);

// Returns the pose of a site in the frame of a body that it is rigidly attached to. Throws InputError if the
// site does not exist, or if it is not rigidly attached to the body.
Eigen::Isometry3d SiteInBody(const mjModel& model, const std::string& site, int body);

// The hinge on which a body turns, in a given state.
struct Hinge {
  Eigen::Vector3d point, direction;  // of the hinge axis, world frame; direction is a unit vector
  double angle, lower, upper;        // current angle of the body and its range, rad
  int qpos;                          // index in qpos
};

// Two geoms that are too close to each other. The distance is in m, and negative if they penetrate each
// other.
struct Touch {
  int geom, other;
  double distance;
};

// Finds contacts of the robot with MuJoCo's collision detection, on a private copy of the scene in which
// every geom has the clearance as its margin.
class ContactProbe {
 public:
  ContactProbe(const mjModel& model, const model_info_t& info, double clearance_m);

  // Sets the poses of all bodies from `state`. Throws std::runtime_error if the state belongs to another
  // model.
  void Set(const state_t& state);
  void SetArm(int arm, const JointVector& q);
  // Throws InputError unless the body has a free joint.
  void SetObject(int body, const Eigen::Isometry3d& pose);
  void SetAngle(const Hinge& hinge, double angle);

  // Returns the hinge of a body. Throws InputError unless the body has exactly one hinge, with a range.
  Hinge HingeOf(int body, const state_t& state) const;

  // Finds a contact of one of these arms, hands included. It ignores contacts with arms that are not in
  // `arms`, contacts of pads with each other and with the objects of allowed_contact_bodies, and contacts
  // between links of one arm that are also this close to each other at home.
  std::optional<Touch> FindTouch(const std::vector<int>& arms,
                                 const std::vector<int>& allowed_contact_bodies);

  // Returns a description of a contact, such as "left/link0 is 0.99 mm from left/link1, expected a distance
  // of 3 mm".
  std::string InWords(const Touch& touch) const;

 private:
  // Finds pairs of links that nearly touch at home, such as neighbors.
  void FindNearAtHome(const model_info_t& info);
  std::pair<int, int> BodiesOf(int geom, int other) const;
  void SetMocap(int body, const Eigen::Isometry3d& pose);

  ModelPtr model_;
  DataPtr data_;
  std::vector<std::vector<int>> arm_qpos_;
  // Arm (or -1) and entity to which each geom belongs, and whether it is a pad.
  std::vector<int> arm_of_geom_, entity_of_geom_;
  std::vector<char> is_pad_;
  std::vector<int> entity_of_body_;
  // Pairs of bodies of links that nearly touch at home. The lower index comes first.
  std::set<std::pair<int, int>> near_at_home_;
  double clearance_;
};

}  // namespace evalbus::policy
