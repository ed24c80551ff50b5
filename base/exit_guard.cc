#include "base/exit_guard.h"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace evalbus {
namespace {

// Process in which a guard exists; 0: none.
std::atomic<pid_t> g_guarded{0};

void RefuseExit(int status, void*) {
  if (g_guarded != getpid()) return;
  std::fflush(stdout);
  std::fprintf(
      stderr,
      "error: exit(%d) was called before the end of the program; a plugin must return or throw instead\n",
      status);
  _exit(2);
}

}  // namespace

ExitGuard::ExitGuard() {
  static const int registered = on_exit(RefuseExit, nullptr);
  if (registered == 0) g_guarded = getpid();
}

ExitGuard::~ExitGuard() { g_guarded = 0; }

}  // namespace evalbus
