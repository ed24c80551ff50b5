// Reads arbitrary text as the MJCF file of a scene part, composes it into a scene, compiles the scene and
// steps it.
#include "base/errors.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_scene.h"

FUZZ_TARGET(mjcf) {
  using namespace evalbus;
  static const SmallScene scene;
  static const TaskDescription task = ParseTask(SmallTask(), scene.path() / "task.yaml", true);
  static const RobotDescription robot = LoadRobot(scene.path() / "robot.yaml");
  scene.Write("pot.xml", data, size);
  try {
    PlayTask(task, "base", robot);
  } catch (const InputError&) {
  } catch (const EnvironmentError&) {
  }
  return 0;
}
