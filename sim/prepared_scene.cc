#include "sim/prepared_scene.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "base/errors.h"
#include "base/file_errors.h"
#include "base/input_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "lcmtypes/clock.h"
#include "models/force_limits.h"
#include "models/model_names.h"
#include "models/physics_model.h"
#include "models/randomized_model.h"
#include "sim/roboeval_start.h"

namespace evalbus::sim {
namespace {

// MuJoCo does not report write errors. Therefore MuJoCo writes to memory, and evalbus writes to the disk.
// file: name of the model's file, for errors.
std::string CompiledModel(const mjModel* model, const char* file) {
  const int memory = memfd_create("model", MFD_CLOEXEC);
  if (memory < 0) throw EnvironmentError(std::string("memfd_create: ") + std::strerror(errno));
  const std::string name = "/proc/self/fd/" + std::to_string(memory);
  mj_saveModel(model, name.c_str(), nullptr, 0);
  std::string bytes(std::filesystem::file_size(name), '\0');
  const ssize_t size = pread(memory, bytes.data(), bytes.size(), 0);
  // If the memory file could not take the whole model (ulimit -f), it cannot take one more byte either.
  // (mj_sizeModel cannot be used: it returns more than the actual size.)
  const bool is_whole = size == static_cast<ssize_t>(bytes.size()) && pwrite(memory, "", 1, size) == 1;
  const int error = errno;
  close(memory);
  if (!is_whole)
    throw EnvironmentError(std::string("cannot write the compiled model ") + file + ": " +
                           std::strerror(error));
  return bytes;
}

// Throws InputError if the variation contains names that the models do not have. This check runs before any
// episode begins.
void CheckDraws(const Variation& variation, const Scene& scene) {
  if (!variation.physics.empty()) {
    RandomizePhysics(variation, 0, ModelPtr(mj_copyModel(nullptr, scene.physics.get())).get());
  }
  if (!variation.appearance.empty()) {
    RandomizeAppearance(variation, 0, ModelPtr(mj_copyModel(nullptr, scene.visual.get())).get());
  }
}

PreparedScene Find(const SimOptions& options) {
  CheckSimOptions(options);
  PreparedScene prepared;
  TaskSelection selection = FindTask(options.task);
  prepared.task = std::move(selection.task);
  prepared.variation = selection.variation;
  // Assets are not needed if the options have digests of models, because the scene has been compiled already.
  if (options.physics_sha256.empty()) prepared.task.FindAssets(options.sources());
  prepared.robot = LoadRobot(options.robot.empty() ? prepared.task.robot_file : FindRobot(options.robot),
                             options.sources());
  return prepared;
}

// Fills MODEL from the scene and the options of the run.
void Describe(const SimOptions& options, PreparedScene* prepared) {
  model_info_t& info = prepared->info = prepared->scene.info;
  info.message_version = model_info_t::VERSION;
  info.run_id = options.run_id;
  info.variation = prepared->variation;
  info.clock = options.is_source  ? clock_name::kSource
               : options.realtime ? clock_name::kRealtime
                                  : clock_name::kLockstep;
  info.realtime_factor = options.realtime ? options.rtf : 0;
  SimOptions real = options;
  const std::string rate = MakeControlRateReal(info.timestep_us, &real);
  if (!rate.empty()) prepared->scene.warnings.push_back(rate);
  if (options.is_source) {
    info.timestep_us = std::llround(1e6 / real.control_hz);
    info.substeps = 1;
  } else {
    info.substeps = Substeps(real.control_hz, info.timestep_us);
  }
  const double tick_s = ControlPeriod(info);
  if (!options.limits.empty()) {
    info.limits_file = options.limits;
    info.limits_yaml = ReadInput(options.limits, "force limits");
    // Throws InputError for names that do not fit the model.
    const ModelNames names(info);
    for (const ForceLimit& limit : ParseForceLimits(info.limits_yaml, info.limits_file))
      BodiesOf(limit, names);
  }
  info.after_success_us = TickUs(std::llround(std::ceil(options.after_success_s / tick_s - 1e-6)), tick_s);
}

}  // namespace

PreparedScene ComposeScene(const SimOptions& options) {
  PreparedScene prepared = Find(options);
  prepared.scene = BuildScene(prepared.task, prepared.robot);
  CheckDraws(prepared.task.variation(prepared.variation), prepared.scene);
  if (options.seed_stream == kRoboEvalSeeds) CheckRoboEvalStart(prepared.task.variation(prepared.variation));
  Describe(options, &prepared);
  prepared.physics_file = CompiledModel(prepared.scene.physics.get(), kPhysicsModel);
  prepared.visual_file = CompiledModel(prepared.scene.visual.get(), kVisualModel);
  prepared.info.physics_sha256 = Sha256Text(prepared.physics_file);
  prepared.info.visual_sha256 = Sha256Text(prepared.visual_file);
  return prepared;
}

void WriteModels(const PreparedScene& prepared, const std::filesystem::path& run) {
  const auto folder = run / kModelFolder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) ThrowFileError("cannot create " + folder.string(), error.value());
  WriteWhole(folder / kSceneXml, prepared.scene.xml);
  WriteWhole(folder / kPhysicsModel, prepared.physics_file);
  WriteWhole(folder / kVisualModel, prepared.visual_file);
}

PreparedScene PrepareScene(const SimOptions& options) {
  PreparedScene prepared;
  if (options.physics_sha256.empty()) {
    prepared = ComposeScene(options);
    WriteModels(prepared, options.out);
  } else {
    prepared = Find(options);
    prepared.scene =
        LoadScene(prepared.task, prepared.robot, options.out, options.physics_sha256, options.visual_sha256);
    prepared.scene.warnings = options.scene_warnings;
    Describe(options, &prepared);
    prepared.info.physics_sha256 = options.physics_sha256;
    prepared.info.visual_sha256 = options.visual_sha256;
  }
  UseModelsIn(options.out, &prepared.info);
  return prepared;
}

}  // namespace evalbus::sim
