// Reads arbitrary text as a robot description and composes the robot into a scene.
#include "base/errors.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_scene.h"

FUZZ_TARGET(robot_yaml) {
  using namespace evalbus;
  static const SmallScene scene;
  static const TaskDescription task = ParseTask(SmallTask(), scene.path() / "task.yaml", true);
  try {
    PlayTask(task, "base", LoadRobot(scene.Write("robot.yaml", data, size)));
  } catch (const InputError&) {
  } catch (const EnvironmentError&) {
  }
  return 0;
}
