#include "base/this_process.h"

#include <signal.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>

#include "base/number_from.h"

namespace evalbus {
namespace {

std::string HostPrefix() {
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  return std::string(host) + "-";
}

}  // namespace

std::string ThisProcess() { return HostPrefix() + std::to_string(getpid()); }

bool HasEnded(const std::string& process) {
  const std::string prefix = HostPrefix();
  if (!process.starts_with(prefix)) return false;
  const pid_t pid = NumberFrom<pid_t>(std::string_view(process).substr(prefix.size())).value_or(0);
  return pid > 0 && kill(pid, 0) != 0 && errno == ESRCH;
}

}  // namespace evalbus
