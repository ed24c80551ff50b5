// evalbus doctor: checks what this machine provides, and prints how to fix what is missing.
#include <dlfcn.h>
#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "base/find_program.h"
#include "base/realtime.h"
#include "bus/bus.h"
#include "bus/private_network.h"
#include "cli/commands/commands.h"
#include "models/task_description.h"
#include "runner/components.h"
#include "runner/processes.h"
#include "runner/version.h"

namespace evalbus::commands {
namespace {

void Print(bool good, const std::string& what, const std::string& fix = "") {
  fmt::print("{:<5} {}\n", good ? "ok" : "FAIL", what);
  if (!good && !fix.empty()) fmt::print("      fix: {}\n", fix);
}

// Prints one line per check. Returns 0 if runs with separate processes work, else 2.
int Doctor() {
  fmt::print("evalbus {} ({}{}), MuJoCo {}\n", kVersion, kGitCommit, kGitDirty ? ", modified" : "",
             mj_versionString());

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
    if (!good) Print(false, program.string() + " is missing", "./run builds it");
    all_programs = all_programs && good;
  }
  if (all_programs) Print(true, "component programs in " + runner::Processes::BinaryFolder().string());

  void* osmesa = dlopen("libOSMesa.so.8", RTLD_LAZY);
  Print(osmesa != nullptr, "OSMesa, which renders videos", "apt-get install libosmesa6");
  if (osmesa) dlclose(osmesa);
  const bool has_ffmpeg = !FindProgram("ffmpeg").empty();
  Print(has_ffmpeg, "ffmpeg, which encodes videos", "apt-get install ffmpeg");

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
