// Composes the robot and the scene with its parts, and compiles them into the two models of a run.
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
// Every arm and every scene part is one child of the world body, with the name of its description ("left",
// "pot"). Its descendants are the bodies of its model file ("left/link0", "pot/pot"). The hand of an arm is
// the body "<arm>/hand" below the arm. The joint of a free part has the part's name; a placed part is a mocap
// body. The top body is the part's own frame: its pose is the pose given in the task. Other joints of a part
// start at the `ref` of their file, unless the task sets them.
struct Scene {
  std::string xml;
  std::vector<std::string> warnings;
  // Model with collision geoms only (compiler option discardvisual), which is faster to step. Ids in messages
  // refer to it.
  ModelPtr physics;
  // Model with all geoms, for rendering. Has the same bodies and joints.
  ModelPtr visual;
  // Result of DescribeModel(). The sim fills in the fields of the run.
  model_info_t info{};
};

// Composes and compiles robot and task (with its variation applied). Throws InputError, including for errors
// of MuJoCo's compiler. The message contains file and line of the model file if they are known.
Scene BuildScene(const TaskDescription& task, const RobotDescription& robot);

// Loads the scene from RUN/model/, where its compiled models were stored. `xml` and `warnings` remain empty.
// Throws InputError if a model is missing or does not have the expected SHA-256.
Scene LoadScene(const TaskDescription& task, const RobotDescription& robot, const std::filesystem::path& run,
                const std::string& physics_sha256, const std::string& visual_sha256);

}  // namespace evalbus
