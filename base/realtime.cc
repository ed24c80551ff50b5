#include "base/realtime.h"

#include <linux/capability.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace evalbus {
namespace {

// Returns whether locked memory is unlimited. With a limit, locking future pages would make later allocations
// fail.
bool MayLockEverything() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return true;
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3]{};
  return syscall(SYS_capget, &header, data) == 0 && (data[0].effective >> CAP_IPC_LOCK & 1) != 0;
}

}  // namespace

std::string Realtime::Words() const {
  return std::string("real-time priority ") + (is_scheduled ? "on" : "off") + ", memory " +
         (is_locked ? "" : "not ") + "locked";
}

Realtime RequestRealtime(int priority) {
  Realtime got;
  const sched_param parameter{priority};
  got.is_scheduled = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) == 0;
  got.is_locked = MayLockEverything() && mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  return got;
}

Realtime RealtimeAllowed() {
  const pid_t child = fork();
  if (child == 0) {
    const Realtime got = RequestRealtime(1);
    _exit(got.is_scheduled | got.is_locked << 1);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return {};
  return {(WEXITSTATUS(status) & 1) != 0, (WEXITSTATUS(status) & 2) != 0};
}

void LowerPriority() {
  constexpr int kNice = 10;
  if (getpriority(PRIO_PROCESS, 0) < kNice) setpriority(PRIO_PROCESS, 0, kNice);
}

}  // namespace evalbus
