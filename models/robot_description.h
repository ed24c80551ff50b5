// A robot as described by its YAML file: the MJCF models of its arms and grippers, their poses, and the
// joints, actuators and sites that evalbus controls and measures. Names are those in the model file, without
// the prefix that the scene composer adds.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "models/model_sources.h"
#include "models/pose.h"
#include "models/source_location.h"

namespace evalbus {

// A camera on a body. It looks along its -z axis; y points up in the image.
struct CameraDescription {
  std::string name;
  // Body of an arm or its hand. Empty for a camera in the robot's fixed frame.
  std::string body;
  Pose pose;                 // in the body's frame
  double vertical_fov = 45;  // degrees, as in MuJoCo
};

struct ArmDescription {
  // "left", "right", ...
  std::string name;
  // MJCF file, absolute path.
  std::filesystem::path model_file;
  // Pose of the arm's base in the robot's frame.
  Pose base;
  // Joints in the order of every joint array, and their actuators. Each joint has one position actuator.
  std::vector<std::string> joints;
  std::vector<std::string> actuators;
  // Site whose pose is the wrist pose.
  std::string wrist_site;
  // Joint positions at reset, rad.
  std::vector<double> home;
  // Replacements for values of the model file, one per joint. If empty, the file's values are used. Set them
  // for models that were made for the integrators of newer MuJoCo versions (docs/adding_a_robot.md).
  std::vector<double> position_gain;  // N m / rad; also removes the actuator's velocity gain
  std::vector<double> joint_damping;  // N m s / rad
  std::vector<double> armature;       // kg m^2
  // True if the lights in the arm's model file become lights of the scene.
  bool keep_lights = false;
  // MJCF file of the arm's stand (empty if there is none), and its pose in the frame of the arm's base.
  std::filesystem::path stand_file;
  Pose stand_pose;
  // Pairs of bodies between which contacts are disabled, named as in the arm's model. Names of bodies of a
  // hand with its own model begin with "hand/".
  std::vector<std::array<std::string, 2>> excludes;
  std::vector<CameraDescription> cameras;
  // Location of the description in the YAML file.
  SourceLocation location;

  // Returns the prefix of every name of the arm's model in a composed scene: "left/".
  std::string prefix() const { return name + "/"; }
};

struct GripperDescription {
  // Equal to the name of the arm that carries it.
  std::string arm;
  // MJCF file, absolute path. If it is empty, the arm's model contains the gripper, and the names below refer
  // to the arm's model.
  std::filesystem::path model_file;
  // Body of the arm's model to which the hand is attached, and the hand's pose relative to it.
  std::string attach_body;
  Pose mount;
  // Finger joints. opening = mean over the joints of (q - closed) / (open - closed).
  std::vector<std::string> joints;
  double joint_open = 0;    // m (or rad)
  double joint_closed = 0;  // m (or rad)
  // True if these positions are in m, of slide joints; false if they are in rad, of hinges.
  bool is_slide = true;
  // Replacement for the damping of the finger joints. If negative, the file's value is used.
  double joint_damping = -1;
  // Replacement for the actuator's stiffness, N / m or N m / rad; also removes its velocity gain. If 0, the
  // file's values are used.
  double position_gain = 0;
  std::string actuator;
  // Actuator commands for fully open and fully closed, in the actuator's own unit.
  double command_open = 0;
  double command_closed = 0;
  // Opening at reset, 0 closed to 1 open.
  double start_opening = 1;
  // If true, a command is rounded to fully open or fully closed.
  bool binary_command = false;
  // Bodies whose collision geoms are the pads.
  std::vector<std::string> pad_bodies;
  // Location of the description in the YAML file.
  SourceLocation location;

  // Returns the prefix of every name of the gripper's model in a composed scene: "left/hand/", or the arm's
  // "left/".
  std::string prefix() const { return model_file.empty() ? arm + "/" : arm + "/hand/"; }
};

struct RobotDescription {
  std::string name;
  std::filesystem::path file;
  std::vector<ArmDescription> arms;
  // One gripper per arm, in the order of the arms.
  std::vector<GripperDescription> grippers;
  // Cameras with names and bodies as in the composed scene: "roboeval/left_wrist" on "left/link7".
  std::vector<CameraDescription> cameras;
  // True if the robot's controller compensates gravity and Coriolis forces on the arms, as the Panda's own
  // controller does. If false, the servos hold the arms against gravity, so the arms sag.
  bool gravity_compensation = true;
  // Number of physics steps that are simulated from home before an episode begins. Afterwards, everything
  // except the robot is set back to its initial state. RoboEval's reset simulates one step before it places
  // the objects, so its arms already move at tick 0.
  int start_steps = 0;

  std::vector<std::string> arm_names() const;
};

// Returns the YAML files in models/robots, sorted.
std::vector<std::filesystem::path> AllRobots();

// Returns the file of a robot: `name` itself if it is the path of a YAML file, otherwise the file of this
// name in models/robots ("single_panda"). Throws InputError that suggests or lists robots.
std::filesystem::path FindRobot(const std::string& name);

// Reads and checks a robot YAML. Model files are searched in the YAML's own folder, in the folders of
// --model-path (such as a checkout of MuJoCo Menagerie), and in models/robots. Throws InputError.
RobotDescription LoadRobot(const std::filesystem::path& file, const ModelSources& sources = {});

}  // namespace evalbus
