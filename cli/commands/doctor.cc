// Implements `evalbus doctor`, which checks the requirements on this machine and prints how to install what
// is missing.
#include <dlfcn.h>
#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "base/errors.h"
#include "base/find_program.h"
#include "base/realtime.h"
#include "bus/bus.h"
#include "bus/private_network.h"
#include "cli/commands/commands.h"
#include "models/task_description.h"
#include "runner/components.h"
#include "runner/processes.h"
#include "runner/version.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::commands {
namespace {

void Print(bool good, const std::string& what, const std::string& fix = "") {
  fmt::print("{:<5} {}\n", good ? "ok" : "FAIL", what);
  if (!good && !fix.empty()) fmt::print("      fix: {}\n", fix);
}

// Returns the path of the loaded library that defines the symbol.
std::string LibraryOf(const char* symbol) {
  Dl_info library{};
  if (dladdr(dlsym(RTLD_DEFAULT, symbol), &library) == 0) return "unknown";
  return std::filesystem::path(library.dli_fname).lexically_normal().string();
}

// Prints which libraries and programs are used for videos, and which of them are missing.
void PrintVideos() {
  // software: name and library of the available software renderer; empty if none is available. missing: the
  // reason why none is available.
  std::string software, missing;
  try {
    const viz::GlChoice choice = viz::ChooseGl(viz::kDefaultGl);
    if (!choice.warning.empty()) fmt::print("note  {}\n", choice.warning);
    const std::string gl = viz::GlInUse();
    const bool is_osmesa = viz::IsGlInMemory();
    software = fmt::format(": {}, {}", gl, LibraryOf(is_osmesa ? "OSMesaCreateContextExt" : "eglInitialize"));
  } catch (const EnvironmentError& error) {
    missing = error.what();
  }
  Print(!software.empty(), "software rendering of images and videos" + software, missing);
  // A GPU is optional, so a missing GPU is not an error.
  try {
    fmt::print("ok    EGL, for --gl egl: {}\n", viz::ChooseGl("egl").device);
  } catch (const EnvironmentError& error) {
    fmt::print("      EGL, for --gl egl, is missing: {}\n", error.what());
  }
  const std::string ffmpeg = FindFfmpeg().string();
  Print(!ffmpeg.empty(), "ffmpeg, which encodes videos" + (ffmpeg.empty() ? "" : ": " + ffmpeg),
        kInstallFfmpeg);
}

// Prints the result of each check. Returns 0 if multicast works, all programs of components are executable,
// and the task descriptions can be read; otherwise 2.
int Doctor() {
  const std::string mujoco = LibraryOf("mj_versionString");
  fmt::print("evalbus {} ({}{}), MuJoCo {} ({})\n", kVersion, kGitCommit, kGitDirty ? ", modified" : "",
             mj_versionString(), mujoco);
  if (mujoco.starts_with("/usr/lib/x86_64-linux-gnu/")) {
    fmt::print("note  Debian's build of MuJoCo; PyPI's gives the same results faster (docs/engines.md)\n");
  }

  const std::string why = WhyNoMulticast(ReservedBus::Draw().url());
  Print(why.empty(), "LCM multicast on this machine" + (why.empty() ? "" : ": " + why));

  int64_t limit = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> limit;
  Print(limit >= kReceiveBufferBytes,
        fmt::format("UDP receive buffer limit {} bytes (recommended: {}, for images)", limit,
                    kReceiveBufferBytes),
        fmt::format("sysctl -w net.core.rmem_max={}", kReceiveBufferBytes));

  const Realtime realtime = RealtimeAllowed();
  Print(realtime.is_scheduled && realtime.is_locked, "for --realtime: " + realtime.Words(),
        "'@GROUP - rtprio 50' and '@GROUP - memlock unlimited' in /etc/security/limits.conf, then log in "
        "again");

  bool all_programs = true;
  for (const runner::ComponentType& component : runner::AllComponents()) {
    const auto program = runner::Processes::BinaryFolder() / component.program;
    const bool good = access(program.c_str(), X_OK) == 0;
    if (!good)
      Print(false, program.string() + " is missing", "build evalbus again with ./run, or install it again");
    all_programs = all_programs && good;
  }
  if (all_programs) Print(true, "component programs in " + runner::Processes::BinaryFolder().string());

  PrintVideos();

  try {
    Print(true,
          fmt::format("{} task descriptions in {}", AllTasks().size(), (ModelsFolder() / "tasks").string()));
  } catch (const std::exception& error) {
    Print(false, error.what());
    all_programs = false;
  }
  if (!why.empty()) {
    fmt::print(
        "Without multicast, 'evalbus run' uses a private network namespace or --in-process; scores are the "
        "same.\n");
  }
  return why.empty() && all_programs ? 0 : 2;
}

}  // namespace

Action AddDoctor(CLI::App*) { return Doctor; }

}  // namespace evalbus::commands
