// Maps a source's names, joint zeros and object frames to the names, zeros and frames of the task. Used by
// `evalbus watch --map FILE`, and by the same keys in the maps of `evalbus score`. docs/watch.md describes
// the format.
#pragma once

#include <map>
#include <string>

#include "evalbus/body_pose_t.hpp"
#include "models/pose.h"
#include "models/yaml_reader.h"

namespace evalbus::sim {

// Source of the position of one of the task's joints.
struct JointMap {
  // Name of the joint in the source; for a file, name of the column.
  std::string name;
  // The joint's position is sign * (position in the source - zero), in the unit of the source.
  double sign = 1;
  double zero = 0;
  // Location in the file, for error messages.
  YamlValue where{};

  double Position(double its) const { return sign * (its - zero); }
};

// Reads a map from joints of the task to `NAME` or `{column: NAME, sign: -1, zero: NUMBER}`. Throws
// InputError with file, line and key, for example if two joints have the same name in the source.
std::map<std::string, JointMap> ReadJointMaps(const YamlValue& value);
// Reads `rad` or `deg`, and returns the factor from this unit to rad.
double ReadAngleUnit(const YamlValue& value);
// Converts the pose of an object's frame as defined by the source (`its`) to the pose of the frame as defined
// by the task. frame: pose of the task's frame in the source's frame, as read by ReadPose().
body_pose_t PoseInFrame(const body_pose_t& its, const Pose& frame);

struct SourceMap {
  std::string file;
  // Factor from the source's unit to rad, for hinge joints.
  double angle_unit = 1;
  // Sources of the task's joints and objects, with the task's names as keys. Joints and objects that are not
  // listed have the same names, zeros and frames in the source.
  std::map<std::string, JointMap> joints;
  struct Object {
    std::string name;
    Pose frame;
    YamlValue where;
  };
  std::map<std::string, Object> objects;
  // Names of the task that contacts use. The keys are the names in the source.
  struct ContactName {
    std::string name;
    YamlValue where;
  };
  std::map<std::string, ContactName> contacts;
};

// Throws InputError with file, line and key.
SourceMap ReadSourceMap(const std::string& text, const std::string& file);

}  // namespace evalbus::sim
