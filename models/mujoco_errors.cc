#include "models/mujoco_errors.h"

#include <mujoco/mujoco.h>

#include <iostream>
#include <utility>

#include "base/errors.h"
#include "models/polyhedron_contacts.h"

namespace evalbus {
namespace {

std::mutex compile_mutex;
// List of warnings while this thread compiles; otherwise null.
thread_local std::vector<std::string>* compile_warnings = nullptr;

std::mutex sink_mutex;
MujocoWarningSink warning_sink;

void OnError(const char* message) {
  const std::string text = std::string("MuJoCo: ") + message;
  if (compile_warnings) throw InputError(text);
  throw EnvironmentError(text);
}

void OnWarning(const char* message) {
  if (compile_warnings) {
    compile_warnings->push_back(std::string("MuJoCo: ") + message);
    return;
  }
  // The sink is copied and called without the lock, because a sink may set another sink.
  const MujocoWarningSink sink = [] {
    const std::lock_guard lock(sink_mutex);
    return warning_sink;
  }();
  if (sink) {
    sink(message);
  } else {
    std::cerr << "MuJoCo warning: " << message << std::endl;
  }
}

}  // namespace

void InstallMujocoHandlers() {
  // The handlers are set only once, because MuJoCo reads them without a lock.
  static std::once_flag once;
  std::call_once(once, [] {
    mju_user_error = OnError;
    mju_user_warning = OnWarning;
    // Newer versions of MuJoCo compute such contacts themselves.
#if mjVERSION_HEADER / 10 == 22
    InstallPolyhedronContacts();
#endif
  });
}

void SetMujocoWarningSink(MujocoWarningSink sink) {
  const std::lock_guard lock(sink_mutex);
  warning_sink = std::move(sink);
}

MujocoCompileGuard::MujocoCompileGuard(std::vector<std::string>* warnings) : lock_(compile_mutex) {
  InstallMujocoHandlers();
  compile_warnings = warnings;
}

MujocoCompileGuard::~MujocoCompileGuard() { compile_warnings = nullptr; }

}  // namespace evalbus
