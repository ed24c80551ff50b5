#include "base/this_process.h"

#include <signal.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>

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
  const char* const end = process.data() + process.size();
  pid_t pid = 0;
  const auto number = std::from_chars(process.data() + prefix.size(), end, pid);
  if (number.ec != std::errc() || number.ptr != end || pid <= 0) return false;
  return kill(pid, 0) != 0 && errno == ESRCH;
}

}  // namespace evalbus
