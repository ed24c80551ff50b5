#include "bus/private_network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "base/errors.h"
#include "base/find_program.h"
#include "bus/bus.h"
#include "bus/udpm/multicast_receiver.h"

namespace evalbus {
namespace {

void WriteProc(const char* file, const std::string& text) { std::ofstream(file) << text; }

}  // namespace

std::string UrlOfEnvironment() {
  const char* url = std::getenv(kUrlVariable);
  return url ? url : "";
}

std::string WhyNoMulticast(const std::string& url) {
  // The check runs in a child process, because LCM prints long explanations on stderr, and its threads would
  // prevent this process from creating a user namespace.
  int report[2];
  if (pipe(report) != 0) return std::string("pipe: ") + std::strerror(errno);
  const pid_t child = fork();
  if (child < 0) return std::string("fork: ") + std::strerror(errno);
  if (child == 0) {
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    std::string why;
    try {
      Bus(url).SelfCheck();
    } catch (const std::exception& error) {
      why = error.what();
    }
    const bool sent = write(report[1], why.data(), why.size()) == static_cast<ssize_t>(why.size());
    _exit(sent ? 0 : 1);
  }
  close(report[1]);
  std::string why;
  char buffer[512];
  for (ssize_t n; (n = read(report[0], buffer, sizeof buffer)) > 0;)
    why.append(buffer, static_cast<size_t>(n));
  close(report[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0 && why.empty()) why = "the check of bus " + url + " crashed";
  return why;
}

void EnterPrivateNetwork() {
  const uid_t uid = getuid();
  const gid_t gid = getgid();
  if (unshare(CLONE_NEWNET) != 0) {
    if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
      throw EnvironmentError(std::string("no private network namespace: ") + std::strerror(errno));
    }
    WriteProc("/proc/self/setgroups", "deny");
    WriteProc("/proc/self/uid_map", "0 " + std::to_string(uid) + " 1");
    WriteProc("/proc/self/gid_map", "0 " + std::to_string(gid) + " 1");
  }
  // Equivalent of: ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq interface {};
  std::strcpy(interface.ifr_name, "lo");
  bool good = fd >= 0 && ioctl(fd, SIOCGIFFLAGS, &interface) == 0;
  interface.ifr_flags |= IFF_UP | IFF_RUNNING | IFF_MULTICAST;
  good = good && ioctl(fd, SIOCSIFFLAGS, &interface) == 0;
  rtentry route{};
  auto* destination = reinterpret_cast<sockaddr_in*>(&route.rt_dst);
  auto* mask = reinterpret_cast<sockaddr_in*>(&route.rt_genmask);
  destination->sin_family = mask->sin_family = AF_INET;
  destination->sin_addr.s_addr = htonl(0xE0000000);
  mask->sin_addr.s_addr = htonl(0xF0000000);
  route.rt_flags = RTF_UP;
  route.rt_dev = interface.ifr_name;
  good = good && ioctl(fd, SIOCADDRT, &route) == 0;
  const int error = errno;
  if (fd >= 0) close(fd);
  if (!good)
    throw EnvironmentError(std::string("no multicast in the private network: ") + std::strerror(error));
}

ReservedBus ChooseBus(const std::string& asked) {
  if (!asked.empty()) {
    if (!asked.starts_with("udpm://")) {
      throw InputError("--url " + asked + ": expected udpm://ADDRESS:PORT?ttl=0");
    }
    CheckMulticastAddress(asked);
    CheckReceiveBuffer(asked);
    const std::string why = WhyNoMulticast(asked);
    if (!why.empty()) throw EnvironmentError(why);
    return ReservedBus::Chosen(asked);
  }
  ReservedBus bus = ReservedBus::Draw();
  if (WhyNoMulticast(bus.url()).empty()) {
    fmt::print("bus {} (watch with 'evalbus monitor'{})\n", bus.url(),
               FindProgram("lcm-logger").empty() ? "" : ", listen with lcm-logger");
    std::fflush(stdout);
    return bus;
  }
  try {
    EnterPrivateNetwork();
  } catch (const EnvironmentError&) {
    return {};
  }
  fmt::print(
      "bus {} in a private network namespace, because this machine has no multicast ('evalbus doctor' gives "
      "the reason); outside, only 'evalbus monitor' and 'evalbus-viz' can listen\n",
      bus.url());
  std::fflush(stdout);
  return bus;
}

}  // namespace evalbus
