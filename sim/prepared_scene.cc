#include "sim/prepared_scene.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "lcmtypes/clock.h"

namespace evalbus::sim {
namespace {

// MuJoCo does not say whether a disk took what it wrote: it writes to memory, and we to the disk.
std::string CompiledModel(const mjModel* model) {
  const int memory = memfd_create("model", MFD_CLOEXEC);
  if (memory < 0) throw EnvironmentError(std::string("memfd_create: ") + std::strerror(errno));
  const std::string name = "/proc/self/fd/" + std::to_string(memory);
  mj_saveModel(model, name.c_str(), nullptr, 0);
  std::ifstream stream(name, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  close(memory);
  return bytes;
}

void WriteModel(const mjModel* model, const std::filesystem::path& file, std::string* name,
                std::string* sha256) {
  WriteWhole(file, CompiledModel(model));
  *name = std::filesystem::absolute(file).lexically_normal().string();
  *sha256 = Sha256File(*name);
}

}  // namespace

PreparedScene PrepareScene(const SimOptions& options) {
  CheckSimOptions(options);
  PreparedScene prepared;
  TaskSelection selection = FindTask(options.task);
  prepared.task = std::move(selection.task);
  prepared.variation = selection.variation;
  prepared.robot = LoadRobot(options.robot.empty() ? prepared.task.robot_file : FindRobot(options.robot),
                             options.model_path);
  prepared.scene = BuildScene(prepared.task, prepared.robot);

  model_info_t& info = prepared.info = prepared.scene.info;
  info.message_version = model_info_t::VERSION;
  info.run_id = options.run_id;
  info.variation = prepared.variation;
  info.clock = options.realtime ? clock_name::kRealtime : clock_name::kLockstep;
  info.substeps =
      static_cast<int>(std::lround(1 / (options.control_hz * prepared.scene.physics->opt.timestep)));
  const auto tick_us = static_cast<double>(info.timestep_us * info.substeps);
  info.clearance_every_ticks =
      options.clearance_hz > 0
          ? std::max(1, static_cast<int>(std::lround(1e6 / (options.clearance_hz * tick_us))))
          : 0;

  const auto folder = options.out / kModelFolder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError("cannot create " + folder.string() + ": " + error.message());
  WriteWhole(folder / kSceneXml, prepared.scene.xml);
  WriteModel(prepared.scene.physics.get(), folder / kPhysicsModel, &info.physics_file, &info.physics_sha256);
  WriteModel(prepared.scene.visual.get(), folder / kVisualModel, &info.visual_file, &info.visual_sha256);
  return prepared;
}

}  // namespace evalbus::sim
