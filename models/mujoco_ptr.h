// Smart pointers for MuJoCo's objects.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

namespace evalbus {

struct MujocoDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

using ModelPtr = std::unique_ptr<mjModel, MujocoDeleter>;
using DataPtr = std::unique_ptr<mjData, MujocoDeleter>;

}  // namespace evalbus
