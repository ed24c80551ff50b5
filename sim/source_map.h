// Conversion of a source's names, zeros of joints and frames of objects to those of the task: `evalbus watch
// --map FILE`, and the same keys in the maps of `evalbus score`. docs/watch.md describes the format.
#pragma once

#include <map>
#include <string>

#include "evalbus/body_pose_t.hpp"
#include "models/pose.h"
#include "models/yaml_reader.h"

namespace evalbus::sim {

// Where the position of one of our joints comes from.
struct JointMap {
  // The source's name of the joint; in a file, the column.
  std::string name;
  // Our position is sign * (its position - zero), in its unit.
  double sign = 1;
  double zero = 0;
  // For errors.
  YamlValue where{};

  double Position(double its) const { return sign * (its - zero); }
};

// Reads `NAME` or `{column: NAME, sign: -1, zero: NUMBER}`. Throws InputError with file, line and key.
JointMap ReadJointMap(const YamlValue& value);
// Reads `rad` or `deg`, and returns the unit in rad.
double ReadAngleUnit(const YamlValue& value);
// The pose of our frame of an object, given that of the source. frame: our frame in the source's frame of the
// object, as ReadPose() reads it.
body_pose_t PoseInFrame(const body_pose_t& its, const Pose& frame);

struct SourceMap {
  std::string file;
  // rad; for joints that do not slide.
  double angle_unit = 1;
  // By our name. Joints and objects that are not listed have equal names and frames.
  std::map<std::string, JointMap> joints;
  struct Object {
    std::string name;
    Pose frame;
    YamlValue where;
  };
  std::map<std::string, Object> objects;
  // Our names in contacts, by those of the source.
  struct ContactName {
    std::string name;
    YamlValue where;
  };
  std::map<std::string, ContactName> contacts;
};

// Throws InputError with file, line and key.
SourceMap ReadSourceMap(const std::string& text, const std::string& file);

}  // namespace evalbus::sim
