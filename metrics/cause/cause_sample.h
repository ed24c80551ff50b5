// Input of the rules for an episode's decisive moment: one control tick as plain numbers. World frame, SI
// units.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "evalbus/body_pose_t.hpp"
#include "evalbus/condition_t.hpp"

namespace evalbus::metrics {

// Names and sizes that do not change during an episode.
struct CauseConfig {
  double dt = 0;  // s, time between ticks
  std::vector<std::string> arms = {};
  std::vector<int> arm_entity = {};  // index of each arm's entity
  std::vector<int> joint_arm = {};   // index of each joint's arm
  std::vector<std::string> grippers = {};
  std::vector<int> gripper_arm = {};  // index of each gripper's arm
  std::vector<std::string> objects;
  std::vector<std::string> entities;
  std::vector<int> object_entity;  // index of each object's entity
  std::vector<std::string> bodies;
  std::vector<int> body_entity;  // index of each body's entity
};

// A contact of an arm with an entity, which may be the scene, an object or another arm.
struct ArmContact {
  int arm;
  int entity;

  bool operator==(const ArmContact&) const = default;
};

struct CauseSample {
  int64_t tick;
  std::span<const double> opening;                // of each gripper; 0 closed, 1 open
  std::span<const double> closing;                // command by gripper: 0 open, 1 closed; empty if unknown
  std::span<const uint8_t> touching;              // [object * grippers + gripper]: a pad touches the object
  std::span<const uint8_t> pinched;               // same index: pads of both fingers touch it
  std::span<const std::array<double, 3>> object;  // m, origin of each object
  std::span<const std::array<double, 3>> wrist;   // m, position of each arm's wrist
  std::span<const body_pose_t> body;
  std::span<const double> joints;        // rad, of all arms
  std::span<const double> commands;      // rad, commanded positions of these joints; empty if unknown
  std::span<const double> torque;        // N m, by joint; empty if unknown
  std::span<const ArmContact> contacts;  // each pair once
};

// Returns the distance of two points, m.
inline double DistanceOfPoints(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace evalbus::metrics
