// What the metrics of an episode need to know beforehand.
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
  double reached_time = -1;  // simulated seconds, first time; -1: never
};

struct ArmConfig {
  std::string name;
  int num_joints = 0;
  // Joint limits (rad) by joint, both empty where not known.
  std::vector<double> joint_lower;
  std::vector<double> joint_upper;
};

// What is tracked, and the sample windows (>= 1), are a task's own options. A collision window of 20 gives
// the reference implementation's collision counts.
struct MetricsConfig : MetricsOptions {
  std::vector<ArmConfig> arms;
  // Names of the grippers.
  std::vector<std::string> grippers;
  // Manipulated objects in the task's order.
  std::vector<std::string> objects;
  std::vector<GeomOwner> geom_owner;
  // Simulated time between ticks (s): physics steps per tick x physics step.
  double control_dt = 0;

  std::vector<StageState> stages;
  // One entry with an empty name is a plain number in the result.
  std::vector<std::string> target_distances;
  std::vector<std::string> pose_errors;

  // Whether extended metrics are wanted: one of them keeps a number for each sample.
  bool extended = true;
};

}  // namespace evalbus::metrics
