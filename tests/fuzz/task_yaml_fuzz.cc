// Reads arbitrary text as a task description. The scene is composed, compiled, stepped and evaluated.
#include "base/errors.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_scene.h"

FUZZ_TARGET(task_yaml) {
  using namespace evalbus;
  static const SmallScene scene;
  static const RobotDescription robot = LoadRobot(scene.path() / "robot.yaml");
  const std::string text(data, data + size);
  try {
    TaskDescription task = ParseTask(text, scene.path() / "task.yaml", true);
    const std::string variation = task.variations[0].name;
    task.Apply(variation);
    task.ApplyRobot(robot.name, robot.arm_names());
    PlayTask(task, variation, robot);
  } catch (const InputError&) {
  } catch (const EnvironmentError&) {
  }
  return 0;
}
