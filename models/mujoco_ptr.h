// Smart pointers for MuJoCo's objects.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

namespace evalbus {

struct MujocoDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
  void operator()(mjVFS* vfs) const {
    mj_deleteVFS(vfs);
    delete vfs;
  }
};

using ModelPtr = std::unique_ptr<mjModel, MujocoDeleter>;
using DataPtr = std::unique_ptr<mjData, MujocoDeleter>;
using VfsPtr = std::unique_ptr<mjVFS, MujocoDeleter>;

// An empty virtual file system.
inline VfsPtr MakeVfs() {
  VfsPtr vfs(new mjVFS);
  mj_defaultVFS(vfs.get());
  return vfs;
}

}  // namespace evalbus
