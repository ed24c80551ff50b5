// Composes robot, props and scene and compiles them into the two models of a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/mujoco_ptr.h"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus {

// A scene ready to simulate.
//
// Bodies: every arm and every part is one body of the world, called as in its description ("left", "pot"),
// with the bodies of its model file below it ("left/link0", "pot/pot"); a hand is the body "<arm>/hand" on
// the arm. A free part's joint has the part's name, a placed part is a mocap body. That first body is the
// part's own frame: its pose is the pose that the task gives. Other joints of a part start at the `ref` of
// their file.
struct Scene {
  std::string xml;
  std::vector<std::string> warnings;
  // Collision geoms only (compiler discardvisual): faster to step, the model that ids in messages refer to.
  ModelPtr physics;
  // Everything, for rendering; same bodies and joints.
  ModelPtr visual;
  // As DescribeModel() gives it: the run's own fields are left for the sim to fill.
  model_info_t info{};
};

// Composes and compiles robot and task (as its variation has it). Throws InputError, also for what MuJoCo's
// compiler says, with the line of the model file that it means where that can be told.
Scene BuildScene(const TaskDescription& task, const RobotDescription& robot);

// The same, but for `xml` and `warnings`, from RUN/model/, where such a scene was compiled to. Throws
// InputError for models that are not there or are not those that the SHA-256s stand for.
Scene LoadScene(const TaskDescription& task, const RobotDescription& robot, const std::filesystem::path& run,
                const std::string& physics_sha256, const std::string& visual_sha256);

}  // namespace evalbus
