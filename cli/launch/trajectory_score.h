// Scores trajectories that somebody else recorded: columns of a file, mapped to a task by a small YAML,
// become states by forward kinematics, contacts by the collision checker, scores by the metrics, and a run
// folder, without any bus. What is not known is absent from the scores. The YAML: docs/data.md.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "models/yaml_reader.h"

namespace evalbus::launch {

struct TrajectoryMap {
  std::string file;
  std::string task;
  std::string robot;  // empty: the task's own
  double control_hz = 50;
  // Either a column of seconds (or its unit), or samples per second.
  std::string time_column;
  double time_scale = 1;  // s
  double rate_hz = 0;
  // By the joint's name in MODEL.
  std::map<std::string, YamlValue> joints;
  double joint_scale = 1;  // rad; joints that slide are in m
  // By gripper: a column with its values for open and closed, or how far it is open all the time.
  struct Gripper {
    std::string column;
    double open = 1, closed = 0;
    double always = 1;
  };
  std::map<std::string, Gripper> grippers;
  // By object: columns of position, m, and of quaternion, w x y z, world frame.
  struct Object {
    std::array<std::string, 3> position;
    std::array<std::string, 4> quaternion;
    YamlValue where;
  };
  std::map<std::string, Object> objects;
};

// Throws InputError with file, line and key.
TrajectoryMap ReadTrajectoryMap(const std::string& text, const std::string& file);

// Of one file, or of all files of a folder, sorted, which become episodes 0, 1, ... Prints a table. Nothing
// is left behind where any of them is wrong. Throws InputError, EnvironmentError.
void ScoreTrajectories(const std::filesystem::path& map, const std::filesystem::path& data,
                       const std::filesystem::path& out);

}  // namespace evalbus::launch
