#include "models/physics_model.h"

#include <mujoco/mujoco.h>

#include <string>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "models/model_consistency.h"
#include "models/mujoco_errors.h"

namespace evalbus {
namespace {

ModelPtr Load(const model_info_t& info, const std::string& file, const std::string& sha256,
              const std::string& name) {
  CheckMessageVersion(info);
  CheckConsistency(info);
  // The name comes from a message, so it must not give access to other files of this machine.
  const std::filesystem::path path(file);
  if (!path.is_absolute() || path != path.lexically_normal() || path.filename() != name ||
      path.parent_path().filename() != kModelFolder) {
    throw InputError("MODEL names the file '" + file + "', expected RUN/" + kModelFolder + "/" + name +
                     " as an absolute path");
  }
  return LoadModel(path, sha256);
}

}  // namespace

ModelPtr LoadModel(const std::filesystem::path& file, const std::string& sha256) {
  InstallMujocoHandlers();
  if (Sha256File(file) != sha256) {
    throw InputError(file.string() +
                     " is not the model of this run: its SHA-256 is not the one in MODEL or run.json");
  }
  ModelPtr model(mj_loadModel(file.c_str(), nullptr));
  if (!model) throw InputError(file.string() + " is not a compiled model of MuJoCo " + mj_versionString());
  return model;
}

void CheckMessageVersion(const model_info_t& info) {
  if (info.message_version == model_info_t::VERSION) return;
  throw InputError("message version " + std::to_string(info.message_version) +
                   ", but this evalbus reads version " + std::to_string(model_info_t::VERSION));
}

ModelPtr LoadPhysicsModel(const model_info_t& info) {
  ModelPtr model = Load(info, info.physics_file, info.physics_sha256, kPhysicsModel);
  if (model->nbody != info.num_bodies || model->ngeom != info.num_geoms) {
    throw InputError("MODEL describes " + std::to_string(info.num_bodies) + " bodies and " +
                     std::to_string(info.num_geoms) + " geoms, " + info.physics_file + " has " +
                     std::to_string(model->nbody) + " and " + std::to_string(model->ngeom));
  }
  CheckCoordinates(info, model->nq);
  return model;
}

ModelPtr LoadVisualModel(const model_info_t& info) {
  return Load(info, info.visual_file, info.visual_sha256, kVisualModel);
}

void UseModelsIn(const std::filesystem::path& run, model_info_t* info) {
  const std::filesystem::path folder = std::filesystem::absolute(run).lexically_normal() / kModelFolder;
  if (std::filesystem::exists(folder / kPhysicsModel)) info->physics_file = folder / kPhysicsModel;
  if (std::filesystem::exists(folder / kVisualModel)) info->visual_file = folder / kVisualModel;
}

}  // namespace evalbus
