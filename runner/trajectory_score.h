// Scores trajectories recorded by external systems. A YAML file (docs/data.md) maps columns of a file to a
// task. Forward kinematics gives the states, the collision checker the contacts, and the metrics the scores,
// which are written into a run folder, without a bus. Metrics whose inputs are missing are omitted.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "models/yaml_reader.h"
#include "sim/source_map.h"

namespace evalbus::runner {

struct TrajectoryMap {
  std::string file;
  std::string task;
  std::string robot;  // empty: the task's own
  double control_hz = 50;
  // Either a column of times with their unit, or a sampling rate.
  std::string time_column;
  double time_scale = 1;  // s
  double rate_hz = 0;
  // By the joint's name in MODEL.
  std::map<std::string, sim::JointMap> joints;
  double joint_scale = 1;  // rad; joints that slide are in m
  // By gripper: a column with its values for open and closed, or a constant opening (`always`).
  struct Gripper {
    std::string column;
    double open = 1, closed = 0;
    double always = 1;
  };
  std::map<std::string, Gripper> grippers;
  // By object: columns of the position, m, and the quaternion, w x y z, in the world frame.
  struct Object {
    std::array<std::string, 3> position;
    std::array<std::string, 4> quaternion;
    // Our frame of the object in the recorded one.
    Pose frame{};
    YamlValue where;
  };
  std::map<std::string, Object> objects;
};

// Throws InputError with file, line and key.
TrajectoryMap ReadTrajectoryMap(const std::string& text, const std::string& file);

// Scores a file, or all files of a folder, sorted by name, as episodes 0, 1, ... Prints a table. Writes
// nothing if any file is invalid. Throws InputError, EnvironmentError.
void ScoreTrajectories(const std::filesystem::path& map, const std::filesystem::path& data,
                       const std::filesystem::path& out);

}  // namespace evalbus::runner
