#include "models/physics_model.h"

#include <iostream>
#include <string>

#include "bus/errors.h"
#include "models/scene.h"

namespace evalbus {

ModelPtr LoadPhysicsModel(const model_info_t& info) {
  InstallMujocoHandlers();
  if (Sha256File(info.physics_file) != info.physics_sha256) {
    throw InputError(info.physics_file +
                     " is not the model of this run: its SHA-256 is not the one in MODEL");
  }
  ModelPtr model(mj_loadModel(info.physics_file.c_str(), nullptr));
  if (!model)
    throw InputError(info.physics_file + " is not a compiled model of MuJoCo " + mj_versionString());
  return model;
}

void InstallMujocoHandlers() {
  mju_user_error = [](const char* message) { throw EnvironmentError(std::string("MuJoCo: ") + message); };
  mju_user_warning = [](const char* message) { std::cerr << "MuJoCo warning: " << message << std::endl; };
}

}  // namespace evalbus
