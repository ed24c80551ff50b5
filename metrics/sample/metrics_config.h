// Configuration of an episode's metrics, known before the first sample.
#pragma once

#include <string>
#include <vector>

#include "metrics/sample/sample.h"
#include "models/task_description.h"

namespace evalbus::metrics {

struct StageState {
  int index = 0;  // >= 1
  std::string name;
  bool reached = false;
  double reached_time = -1;  // simulated time at which it was first reached, s; -1: never
};

struct ArmConfig {
  std::string name;
  int num_joints = 0;
  // Joint limits (rad) by joint; both empty if unknown.
  std::vector<double> joint_lower;
  std::vector<double> joint_upper;
  // Torque limits (N m) by joint, 0 for a joint without limit; empty if unknown.
  std::vector<double> joint_torque_limit = {};
};

// The tracked metrics and the sample windows (>= 1) are options of the task. A collision window of 20
// reproduces the collision counts of the reference implementation.
struct MetricsConfig : MetricsOptions {
  std::vector<ArmConfig> arms;
  std::vector<std::string> grippers;
  // Manipulated objects, in the task's order.
  std::vector<std::string> objects;
  std::vector<GeomOwner> geom_owner;
  // Simulated time between ticks, s (ControlPeriod in lcmtypes/clock.h).
  double control_dt = 0;

  std::vector<StageState> stages;
  // A single entry with an empty name becomes a plain number in the result.
  std::vector<std::string> target_distances;
  std::vector<std::string> pose_errors;

  // True if extended metrics are computed. These metrics require memory, because some of them store numbers
  // of all samples.
  bool extended = true;
};

}  // namespace evalbus::metrics
