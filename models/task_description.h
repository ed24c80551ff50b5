// A task as its YAML file describes it: scene, randomization per variation, metrics, stages and verdict.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "models/expression.h"
#include "models/pose.h"
#include "models/randomization.h"
#include "models/source_location.h"

namespace evalbus {

struct Stage {
  int index = 0;
  std::string name;
  Expression when;
};

// A part of the scene: an MJCF file attached under the prefix "<name>/" at a pose in the world.
struct ScenePart {
  std::string name;
  std::filesystem::path model_file;
  Pose pose;
  // Attached with a free joint.
  bool free = false;
  // Not free, but some variation places it anew at each reset: attached as a mocap body.
  bool placed = false;
  // Where the task describes it.
  SourceLocation location;
};

// Where a joint, of a part or of the robot, is at the start, rad or m.
struct JointStart {
  std::string joint;
  bool is_angle = false;
  double position = 0;
  SourceLocation location;
};

// A camera that stands in the world, with its up as near to the vertical as it can be.
struct Camera {
  std::string name;
  std::array<double, 3> position{};  // m
  std::array<double, 3> look_at{};   // m
  double vertical_fov = 0;           // degrees, as MuJoCo has it
};

struct Variation : Randomized {
  std::string name;  // "base", "position", "orientation", "position_and_orientation", ...
  // Where the task describes it.
  SourceLocation location;
  // RoboEval's class name ("LiftPotPosition").
  std::string alias;
  // What it has besides the task's own, and instead; see TaskDescription::Apply.
  std::vector<ScenePart> parts;
  std::optional<Pose> robot_base;
  std::map<std::string, Pose> poses;  // of parts, by name
  std::vector<JointStart> joints;     // before the task's
  std::vector<Camera> cameras;        // likewise
  std::string instruction;            // empty: the task's
  std::vector<Stage> stages;          // empty: the task's
  Expression success, failure;        // name empty: the task's
};

// A body or geom of an object of which only some may be touched.
struct AllowedContact {
  std::string object;
  std::string name;
  SourceLocation location;
};

// What a task has instead of its own with another robot than its own.
struct OtherRobot {
  std::string name;
  // Also for any robot with just these arms that has no entry of its name; empty: for none.
  std::vector<std::string> arms;
  std::vector<NamedExpression> target_distance;
};

struct MetricsOptions {
  // What is switched off, as the member of TrackOption (lcmtypes/metric_catalog.h).
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
  // What a policy that takes language is told; may be empty.
  std::string instruction;
  std::filesystem::path file;
  // The file's whole text, as it travels in MODEL.
  std::string text;

  std::filesystem::path robot_file;
  Pose robot_base;
  double time_limit = 0;  // s, simulated
  // MJCF file with options, floor, lights and cameras that the parts are attached to.
  std::filesystem::path scene_file;
  std::vector<ScenePart> parts;
  // Manipulated objects (names of parts), in the order of slip_count_per_object.
  std::vector<std::string> objects;
  // Of an object that has any, the rest counts as fixture in collisions and clearance.
  std::vector<AllowedContact> allowed_contacts;
  // Where they are not at the robot's home or where their file has them.
  std::vector<JointStart> joints;
  // Besides those of the scene, or instead.
  std::vector<Camera> cameras;
  std::vector<Variation> variations;

  MetricsOptions metrics;
  std::vector<Stage> stages;
  Expression success;
  // Name empty: no failure condition besides the built-in ones.
  Expression failure;
  std::vector<NamedExpression> target_distance;
  std::vector<NamedExpression> pose_error;
  std::vector<OtherRobot> other_robots;

  // Throws InputError that lists the variations there are.
  const Variation& variation(const std::string& name) const;

  // Makes this the task as the variation has it: with its parts besides the task's own, and its robot base,
  // poses, joints, cameras, instruction, stages and verdict in their place. For one variation of a task as it
  // was read. Throws as variation() does.
  void Apply(const std::string& variation);
  // The same for a robot by its name and those of its arms, in place of the task's own; one that the task
  // does not speak of changes nothing.
  void ApplyRobot(const std::string& robot, const std::vector<std::string>& arms);
};

// Reads and checks a task YAML from a file, or from text whose relative paths are resolved against `file`.
// With check_files, model and robot files must exist. Throws InputError.
TaskDescription LoadTask(const std::filesystem::path& file);
TaskDescription ParseTask(const std::string& text, const std::filesystem::path& file, bool check_files);

// Finding tasks (find_task.cc).

// A task as one of its variations has it, found by "lift_pot", "lift_pot/position" or RoboEval's
// "LiftPotPosition" among the YAML files of models/tasks, or by the path of a YAML file
// ("my_task.yaml/position"). Throws InputError that lists the tasks there are.
struct TaskSelection {
  TaskDescription task;
  std::string variation;
};
TaskSelection FindTask(const std::string& name);

// Whether FindTask() takes `name` for the path of a YAML file.
bool IsTaskFile(const std::string& name);

// Every task of models/tasks as it was read, sorted by name.
std::vector<TaskDescription> AllTasks();

// Folder with robots/, props/ and tasks/: $EVALBUS_MODELS; else ../share/evalbus/models beside an installed
// program, the source tree's, or /usr/share/evalbus/models.
std::filesystem::path ModelsFolder();
std::filesystem::path TasksFolder();

}  // namespace evalbus
