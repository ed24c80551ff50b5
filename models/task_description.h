// A task as described by its YAML file: scene, randomization per variation, metrics, stages and verdict.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "models/expression.h"
#include "models/model_sources.h"
#include "models/pose.h"
#include "models/randomization.h"
#include "models/source_location.h"

namespace evalbus {

struct Stage {
  int index = 0;
  std::string name;
  Expression when;
};

// Scene part: an MJCF file attached under the prefix "<name>/" at a pose in the world.
// A named frame on a scene part, in the frame of the part's body.
struct PartSite {
  std::string name;
  Pose pose;
};

struct ScenePart {
  std::string name;
  // "NAME:FILE" until FindAssets() replaces it.
  std::filesystem::path model_file;
  // Bodies of the file that are left out.
  std::vector<std::string> without;
  // Sites that are added to those of the file.
  std::vector<PartSite> sites;
  // True if it may penetrate other parts at the start of an episode.
  bool may_penetrate = false;
  Pose pose;
  // True if attached with a free joint.
  bool free = false;
  // Not free, but a variation sets its pose at each reset: attached as a mocap body.
  bool placed = false;
  // Location of the description in the task file.
  SourceLocation location;
};

// Start position of a joint of a part or of the robot, rad or m.
struct JointStart {
  std::string joint;
  bool is_angle = false;
  double position = 0;
  SourceLocation location;
};

// A camera fixed in the world, oriented so that the vertical points up in the image.
struct Camera {
  std::string name;
  std::array<double, 3> position{};  // m
  std::array<double, 3> look_at{};   // m
  double vertical_fov = 0;           // degrees, as in MuJoCo
};

struct Variation : Randomized {
  std::string name;  // "base", "position", "orientation", "position_and_orientation", ...
  // Location of the description in the task file.
  SourceLocation location;
  // RoboEval's class name ("LiftPotPosition").
  std::string alias;
  // Additions to and replacements of the task's own values; see TaskDescription::Apply.
  std::vector<ScenePart> parts;
  std::optional<Pose> robot_base;
  std::map<std::string, Pose> poses;             // of parts, by name
  std::vector<JointStart> joints;                // take precedence over the task's
  std::vector<Camera> cameras;                   // take precedence over the task's
  std::string instruction;                       // empty: the task's
  std::vector<Stage> stages;                     // empty: the task's
  Expression success, failure;                   // name empty: the task's
  std::vector<NamedExpression> target_distance;  // empty: the task's
};

// A body or geom of an object that may be touched, where the rest of the object may not.
struct AllowedContact {
  std::string object;
  std::string name;
  SourceLocation location;
};

// Values that replace the task's own when it is used with a robot other than its own.
struct OtherRobot {
  std::string name;
  // Also applies to any robot with exactly these arms that has no entry of its own. Empty: applies to no
  // other robot.
  std::vector<std::string> arms;
  std::vector<NamedExpression> target_distance;
};

struct MetricsOptions {
  // Disabled groups of metrics, as the member of TrackOption (lcmtypes/metric_catalog.h).
  std::vector<int8_t metric_values_t::*> untracked;
  bool Tracks(int8_t metric_values_t::*member) const {
    return std::find(untracked.begin(), untracked.end(), member) == untracked.end();
  }
  int slip_sample_window = 20;      // ticks
  int collision_sample_window = 1;  // ticks
};

struct TaskDescription {
  std::string name;   // "lift_pot"
  std::string title;  // one line for people
  // Instruction for policies that take language; may be empty.
  std::string instruction;
  std::filesystem::path file;
  // The file's complete text, as published in MODEL.
  std::string text;

  std::filesystem::path robot_file;
  Pose robot_base;
  double time_limit = 0;  // s, simulated
  // MJCF file with options, floor, lights and cameras, to which the parts are attached.
  std::filesystem::path scene_file;
  std::vector<ScenePart> parts;
  // Manipulated objects (names of parts), in the order of slip_count_per_object.
  std::vector<std::string> objects;
  // Bodies and geoms of objects that may be touched. If an object has any, its other geoms count as fixture
  // in collisions and clearance.
  std::vector<AllowedContact> allowed_contacts;
  // Start positions of joints that differ from the robot's home or from the part's file.
  std::vector<JointStart> joints;
  // Cameras in addition to those of the scene; one with the same name replaces it.
  std::vector<Camera> cameras;
  // Choices of RandomTexture of the applied variation; a variation's own are in its `appearance`.
  std::vector<NameInFile> textures;
  std::vector<Variation> variations;

  MetricsOptions metrics;
  std::vector<Stage> stages;
  Expression success;
  // Name empty: only the built-in failure conditions apply.
  Expression failure;
  std::vector<NamedExpression> target_distance;
  std::vector<NamedExpression> pose_error;
  std::vector<OtherRobot> other_robots;

  // Throws InputError that lists the available variations.
  const Variation& variation(const std::string& name) const;

  // Applies a variation to this task: adds its parts, and replaces robot base, poses, joints, cameras,
  // instruction, stages, verdict and target distances. Must be called at most once, on a task as it was read.
  // Throws as variation() does.
  void Apply(const std::string& variation);
  // Applies the values for a robot, given by its name and those of its arms. No effect if the task has no
  // entry for this robot.
  void ApplyRobot(const std::string& robot, const std::vector<std::string>& arms);
  // Replaces the model files that belong to assets ("NAME:FILE") by their paths. Throws InputError.
  void FindAssets(const ModelSources& sources);
};

// Reads and checks a task YAML from a file, or from text whose relative paths are resolved against `file`.
// With check_files, model and robot files must exist. Throws InputError.
TaskDescription LoadTask(const std::filesystem::path& file);
TaskDescription ParseTask(const std::string& text, const std::filesystem::path& file, bool check_files);

// Search for tasks (find_task.cc).

// A task and the selected variation. `name` is "lift_pot", "lift_pot/position" or RoboEval's
// "LiftPotPosition" among the YAML files of models/tasks; these names with "roboeval/" for files of the
// folder models/tasks/roboeval; or the path of a YAML file ("my_task.yaml/position"). Throws InputError that
// lists the available tasks.
struct TaskSelection {
  TaskDescription task;
  std::string variation;
};
TaskSelection FindTask(const std::string& name);

// True if FindTask() treats `name` as the path of a YAML file.
bool IsTaskFile(const std::string& name);

// Every task of models/tasks as it was read, sorted by name.
std::vector<TaskDescription> AllTasks();
// The tasks in a subfolder of models/tasks, whose scenes need assets of this name ("roboeval"). Their names
// begin with it: "roboeval_lift_pot". Empty if there is no such folder.
std::vector<TaskDescription> TasksOfAssets(const std::string& name);
// Folder with robots/, props/ and tasks/: $EVALBUS_MODELS; otherwise the first that exists of
// ../share/evalbus/models beside the installed program, that of the source tree, and
// /usr/share/evalbus/models.
std::filesystem::path ModelsFolder();
std::filesystem::path TasksFolder();

}  // namespace evalbus
