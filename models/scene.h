// Composes robot, props and scene into one MJCF document and compiles it into the two models of a run.
#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using ModelPtr = std::unique_ptr<mjModel, ModelDeleter>;

// One MJCF document made of several files, everything in a part renamed with its prefix ("pot/base"). MuJoCo 2.2 has no
// attach of its own.
//
// What MuJoCo 2.2 does not know is mapped, each time with a line in warnings(): integrator implicitfast, gravcomp, and
// so on. What cannot be mapped is an InputError that names file, line and element. Mesh and texture files are named by
// absolute path. Of <option>, <visual>, <statistic> and <size> only the base file's count.
class SceneComposer {
 public:
  // base_file: options, floor, lights, cameras.
  explicit SceneComposer(const std::filesystem::path& base_file);
  ~SceneComposer();

  // Attaches the bodies of an MJCF file to the world, or to a body that was attached before ("left/link7").
  void Attach(const std::filesystem::path& file, const std::string& prefix, const Pose& pose, bool free = false,
              const std::string& parent_body = "");

  // Sets an attribute of the named element ("joint", "left/joint1", "damping"); used for a robot's replacements.
  void SetAttribute(const std::string& element, const std::string& name, const std::string& attribute,
                    const std::string& value);

  // The composed document.
  std::string ToXml() const;
  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A scene ready to simulate.
struct Scene {
  std::string xml;
  std::vector<std::string> warnings;
  // Collision geoms only (compiler discardvisual): faster to step, the model that ids in messages refer to.
  ModelPtr physics;
  // Everything, for rendering; same bodies and joints.
  ModelPtr visual;
  // Names, entities, arms, grippers, objects, timestep, time limit; the run's own fields (run_id, variation, files,
  // hashes, clock, substeps, clearance_every_ticks) are left for the sim to fill.
  model_info_t info{};
};

// Composes and compiles robot and task. Throws InputError (also for what MuJoCo's compiler says of the result, with the
// part it came from where that can be told).
Scene BuildScene(const TaskDescription& task, const RobotDescription& robot);

// Lower-case hexadecimal SHA-256 of a file. Throws InputError when it cannot be read.
std::string Sha256File(const std::filesystem::path& file);

}  // namespace evalbus
