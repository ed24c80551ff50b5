// The LiftPot scene, which is composed once for all policy tests.
#pragma once

#include "models/scene.h"

namespace evalbus::policy {

struct PolicyScene {
  TaskDescription task = FindTask("lift_pot").task;
  RobotDescription robot = LoadRobot(task.robot_file);
  Scene scene = BuildScene(task, robot);

  const mjModel& model() const { return *scene.physics; }
  const model_info_t& info() const { return scene.info; }
};

inline const PolicyScene& GetPolicyScene() {
  static const PolicyScene scene;
  return scene;
}

}  // namespace evalbus::policy
