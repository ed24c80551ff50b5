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

// A named frame on a scene part, relative to the frame of the part's body.
struct PartSite {
  std::string name;
  Pose pose;
};

// A scene part: an MJCF file that is attached under the prefix "<name>/" at a pose in the world.
struct ScenePart {
  std::string name;
  // MJCF file. A file of assets is "NAME:FILE" until FindAssets() replaces it by a path.
  std::filesystem::path model_file;
  // Bodies of the file that are removed.
  std::vector<std::string> without;
  // Sites that are added to the sites of the file.
  std::vector<PartSite> sites;
  // True if the part may penetrate other parts in the reset state.
  bool may_penetrate = false;
  Pose pose;
  // True if the part is attached with a free joint.
  bool free = false;
  // True if the part is not free, but a variation sets its pose at each reset. It is attached as a mocap
  // body.
  bool placed = false;
  // Location of the description in the task file.
  SourceLocation location;
};

// Initial position (rad or m) of a joint of a scene part or of the robot.
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
  // Name of RoboEval's class for this variation ("LiftPotPosition").
  std::string alias;
  // Additions to and replacements of the task's own values; see TaskDescription::Apply.
  std::vector<ScenePart> parts;
  std::optional<Pose> robot_base;
  std::map<std::string, Pose> poses;  // poses of parts, by name
  std::vector<JointStart> joints;     // take precedence over the task's joints
  std::vector<Camera> cameras;        // take precedence over the task's cameras
  std::string instruction;            // if empty, the task's value applies
  Expression success, failure;        // if the name is empty, the task's value applies
  // If nullopt, the task's value applies. An empty list removes the task's entries.
  std::optional<std::vector<Stage>> stages;
  std::optional<std::vector<NamedExpression>> target_distance;
};

// A body or geom of an object that may be touched, while the rest of the object must not be touched.
struct AllowedContact {
  std::string object;
  std::string name;
  SourceLocation location;
};

// Values that replace the task's values when the task is used with a robot other than its own.
struct OtherRobot {
  std::string name;
  // The values also apply to any robot that has exactly these arms and is not listed by name. If empty, they
  // apply only to the robot `name`.
  std::vector<std::string> arms;
  std::vector<NamedExpression> target_distance;
};

struct MetricsOptions {
  // Disabled groups of metrics, given by TrackOption::member (lcmtypes/metric_catalog.h).
  std::vector<int8_t metric_values_t::*> untracked;
  bool Tracks(int8_t metric_values_t::*member) const {
    return std::find(untracked.begin(), untracked.end(), member) == untracked.end();
  }
  int slip_sample_window = 20;      // ticks
  int collision_sample_window = 1;  // ticks
};

struct TaskDescription {
  std::string name;   // "lift_pot"
  std::string title;  // one-line description for users
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
  // Initial positions of joints that differ from the robot's home or from the part's file.
  std::vector<JointStart> joints;
  // Cameras in addition to the scene's cameras. A camera with the name of a scene camera replaces it.
  std::vector<Camera> cameras;
  // Choices of all RandomTextures of the applied variation. The choices of each variation are in its
  // `appearance`.
  std::vector<NameInFile> textures;
  std::vector<Variation> variations;

  MetricsOptions metrics;
  std::vector<Stage> stages;
  Expression success;
  // If the name is empty, only the built-in failure condition applies.
  Expression failure;
  std::vector<NamedExpression> target_distance;
  std::vector<NamedExpression> pose_error;
  std::vector<OtherRobot> other_robots;

  // Throws InputError that suggests or lists variations.
  const Variation& variation(const std::string& name) const;

  // Applies a variation to this task: adds its parts, and replaces robot base, poses, joints, cameras,
  // instruction, stages, verdict and target distances. Must be called at most once, and only on an unmodified
  // task. Throws InputError if there is no such variation.
  void Apply(const std::string& variation);
  // Applies the values for a robot, given by its name and the names of its arms. Has no effect if the task
  // has no entry for this robot.
  void ApplyRobot(const std::string& robot, const std::vector<std::string>& arms);
  // Replaces the model files that belong to assets ("NAME:FILE") by their paths. Throws InputError.
  void FindAssets(const ModelSources& sources);
};

// Reads and checks a task YAML from a file, or from text whose relative paths are resolved against `file`.
// With check_files, model and robot files must exist. Throws InputError.
TaskDescription LoadTask(const std::filesystem::path& file);
TaskDescription ParseTask(const std::string& text, const std::filesystem::path& file, bool check_files);

// Search for tasks (find_task.cc).

struct TaskSelection {
  // The task with the selected variation applied.
  TaskDescription task;
  std::string variation;
};
// Finds a task by a name of one of these forms:
//   - "lift_pot", "lift_pot/position" or RoboEval's "LiftPotPosition", for YAML files of models/tasks;
//   - one of these names with the prefix "roboeval/" or "roboeval_", for files of models/tasks/roboeval;
//   - the path of a YAML file, optionally with a variation ("my_task.yaml/position").
// Without a variation, selects the first one. Throws InputError, which suggests a similar name or lists the
// available tasks, if there is no such task.
TaskSelection FindTask(const std::string& name);

// Returns true if FindTask() treats `name` as the path of a YAML file.
bool IsTaskFile(const std::string& name);

// Returns every task of models/tasks as it was read, sorted by name.
std::vector<TaskDescription> AllTasks();
// Returns the tasks whose scenes require assets of this name ("roboeval"), from the subfolder of models/tasks
// with this name. Their names begin with the name of the assets: "roboeval_lift_pot". Empty if there is no
// such folder.
std::vector<TaskDescription> TasksOfAssets(const std::string& name);
// Returns the folder with robots/, props/ and tasks/. It is $EVALBUS_MODELS if that is set. Otherwise it is
// the first of these folders that exists: ../share/evalbus/models next to the installed program, models/ in
// the source tree, and /usr/share/evalbus/models.
std::filesystem::path ModelsFolder();
std::filesystem::path TasksFolder();

}  // namespace evalbus
