#include "base/run_layout.h"
#include "models/model_info.h"
#include "models/physics_model.h"
#include "models/scene.h"

namespace evalbus {

Scene LoadScene(const TaskDescription& task, const RobotDescription& robot, const std::filesystem::path& run,
                const std::string& physics_sha256, const std::string& visual_sha256) {
  Scene scene;
  scene.physics = LoadModel(run / kModelFolder / kPhysicsModel, physics_sha256);
  scene.visual = LoadModel(run / kModelFolder / kVisualModel, visual_sha256);
  scene.info = DescribeModel(task, robot, *scene.physics);
  return scene;
}

}  // namespace evalbus
