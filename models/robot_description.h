// A robot as its YAML file describes it: which MJCF models its arms and grippers are, where they stand, and
// which of their joints, actuators and sites evalbus drives and measures. Names here are those inside the
// model file, without the prefix that the scene composer adds.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "models/pose.h"
#include "models/source_location.h"

namespace evalbus {

// A camera on a body. It looks along its -z axis, y is up in the image.
struct CameraDescription {
  std::string name;
  // Of an arm or its hand; empty: the robot's frame, which does not move.
  std::string body;
  Pose pose;                 // in the body's frame
  double vertical_fov = 45;  // degrees, as MuJoCo has it
};

struct ArmDescription {
  // "left", "right", ...
  std::string name;
  // MJCF file, absolute.
  std::filesystem::path model_file;
  // Pose of the arm's base in the robot's frame.
  Pose base;
  // In the order of every joint array; one position actuator per joint.
  std::vector<std::string> joints;
  std::vector<std::string> actuators;
  // Site whose pose is the wrist pose.
  std::string wrist_site;
  // Joint positions at reset, rad.
  std::vector<double> home;
  // Replacements for what the model file says, one value per joint; empty = as in the file. Needed for models
  // made for newer MuJoCo integrators (docs/adding_a_robot.md).
  std::vector<double> position_gain;  // N m / rad; also removes the actuator's velocity gain
  std::vector<double> joint_damping;  // N m s / rad
  std::vector<double> armature;       // kg m^2
  // What the arm stands on, an MJCF file at a pose in the base's frame; empty: nothing.
  std::filesystem::path stand_file;
  Pose stand_pose;
  // Pairs of bodies that never touch one another. Names of the arm's model; those of a hand with a model of
  // its own begin with "hand/".
  std::vector<std::array<std::string, 2>> excludes;
  std::vector<CameraDescription> cameras;
  // Where the file describes it.
  SourceLocation location;

  // What stands before every name of its model in a composed scene: "left/".
  std::string prefix() const { return name + "/"; }
};

struct GripperDescription {
  // Same name as the arm that carries it.
  std::string arm;
  // MJCF file, absolute. Empty: the arm's own model contains it, and the names below are names in that model.
  std::filesystem::path model_file;
  // Body of the arm's model that the hand is attached to, and the pose of the hand in it.
  std::string attach_body;
  Pose mount;
  // Finger joints: opening = mean over them of (q - closed) / (open - closed).
  std::vector<std::string> joints;
  double joint_open = 0;    // m (or rad)
  double joint_closed = 0;  // m (or rad)
  // Replacement for the finger joints' damping; negative = as in the file.
  double joint_damping = -1;
  // Replacement for the actuator's stiffness, N / m or N m / rad, without a velocity gain; 0 = as in the
  // file.
  double position_gain = 0;
  std::string actuator;
  // Actuator command for fully open and fully closed, in the actuator's own unit.
  double command_open = 0;
  double command_closed = 0;
  // Bodies whose collision geoms are the pads.
  std::vector<std::string> pad_bodies;
  // Where the file describes it.
  SourceLocation location;

  // What stands before every name of its model in a composed scene: "left/hand/", or the arm's "left/".
  std::string prefix() const { return model_file.empty() ? arm + "/" : arm + "/hand/"; }
};

struct RobotDescription {
  std::string name;
  std::filesystem::path file;
  std::vector<ArmDescription> arms;
  // One per arm, in the order of the arms.
  std::vector<GripperDescription> grippers;
  // Names of these and of their bodies are the scene's: "roboeval/left_wrist" on "left/link7".
  std::vector<CameraDescription> cameras;

  std::vector<std::string> arm_names() const;
};

// The descriptions in models/robots, sorted.
std::vector<std::filesystem::path> AllRobots();

// The file of a robot that is named: the path of a YAML file as it is, else one of models/robots
// ("single_panda"). Throws InputError that lists those there are.
std::filesystem::path FindRobot(const std::string& name);

// Reads and checks a robot YAML. model_path: folders in which model files are looked for after the YAML's own
// folder and before models/robots (a checkout of MuJoCo Menagerie, for instance). Throws InputError.
RobotDescription LoadRobot(const std::filesystem::path& file,
                           const std::vector<std::filesystem::path>& model_path = {});

}  // namespace evalbus
