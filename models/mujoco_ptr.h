// Smart pointers for MuJoCo's objects.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

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

// Creates an empty virtual file system.
inline VfsPtr MakeVfs() {
  VfsPtr vfs(new mjVFS);
  mj_defaultVFS(vfs.get());
  return vfs;
}

// Adds a file with these contents.
inline void AddToVfs(const char* name, const std::string& contents, mjVFS* vfs) {
  const int size = static_cast<int>(contents.size());
#if mjVERSION_HEADER >= 313
  mj_addBufferVFS(vfs, name, contents.data(), size);
#else
  mj_makeEmptyFileVFS(vfs, name, size);
  contents.copy(static_cast<char*>(vfs->filedata[mj_findFileVFS(vfs, name)]), contents.size());
#endif
}

}  // namespace evalbus
