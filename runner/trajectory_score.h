// Scores trajectories recorded by external systems. A YAML file (docs/data.md) maps columns of a file to a
// task. States are computed by forward kinematics, and contacts by the collision checker. Logs and scores are
// written into a run folder; no bus is used. Metrics whose inputs are missing are omitted.
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
  std::string robot;  // empty: the robot of the task
  double control_hz = 50;
  // Times of the samples: either a column with its unit (time_scale), or a sampling rate.
  std::string time_column;
  double time_scale = 1;  // s
  double rate_hz = 0;
  // Mapping of each joint, by its name in MODEL.
  std::map<std::string, sim::JointMap> joints;
  double joint_scale = 1;  // rad; joints that slide are in m
  // Mapping of each gripper: a column with its values for open and closed, or a constant opening (`always`).
  struct Gripper {
    std::string column;
    double open = 1, closed = 0;
    double always = 1;
  };
  std::map<std::string, Gripper> grippers;
  // Mapping of each object: columns of the position (m) and the quaternion (w, x, y, z) in the world frame.
  struct Object {
    std::array<std::string, 3> position;
    std::array<std::string, 4> quaternion;
    // Pose of evalbus' frame of the object in the recorded frame.
    Pose frame{};
    YamlValue where;
  };
  std::map<std::string, Object> objects;
};

// Parses a map. Throws InputError with file, line and key.
TrajectoryMap ReadTrajectoryMap(const std::string& text, const std::string& file);

// Scores a file, or all CSV, npz and HDF5 files of a folder, sorted by name, as episodes 0, 1, ... Prints a
// table. Writes nothing if any file is invalid. Throws InputError or EnvironmentError.
void ScoreTrajectories(const std::filesystem::path& map, const std::filesystem::path& data,
                       const std::filesystem::path& out);

}  // namespace evalbus::runner
