// By default, other machines can neither reach the sockets of a run nor receive its messages.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>

#include "base/errors.h"
#include "bus/private_network.h"
#include "tests/integration/harness.h"

namespace evalbus::closed_test {

namespace fs = std::filesystem;

// Returns a copy of another process's file descriptor, or -1 if that is not permitted.
int CopyOf(pid_t pid, int fd) {
  const auto process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  const auto copy = static_cast<int>(syscall(SYS_pidfd_getfd, process, fd, 0));
  close(process);
  return copy;
}

int Option(int socket, int level, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  EXPECT_EQ(getsockopt(socket, level, name, &value, &size), 0) << std::strerror(errno);
  return value;
}

struct Sockets {
  int senders = 0, reservations = 0;
};

// Fails the test for each socket of the process that is neither one end of a local pair, nor a socket of the
// bus at this address, nor the reservation of its port. Counts senders and reservations.
Sockets CheckSockets(pid_t pid, const sockaddr_in& bus) {
  SCOPED_TRACE(ReadText("/proc/" + std::to_string(pid) + "/cmdline").c_str());
  Sockets found;
  int receivers = 0;
  for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
    std::error_code gone;
    if (!fs::read_symlink(entry.path(), gone).string().starts_with("socket:")) continue;
    const int socket = CopyOf(pid, std::atoi(entry.path().filename().c_str()));
    EXPECT_GE(socket, 0) << std::strerror(errno);
    const int domain = Option(socket, SOL_SOCKET, SO_DOMAIN);
    if (domain != AF_UNIX) {
      EXPECT_EQ(domain, AF_INET);
      const bool is_tcp = Option(socket, SOL_SOCKET, SO_TYPE) != SOCK_DGRAM;
      EXPECT_EQ(Option(socket, SOL_SOCKET, SO_ACCEPTCONN), 0);
      sockaddr_in local{}, remote{};
      socklen_t size = sizeof local;
      EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&local), &size), 0);
      if (is_tcp) {
        EXPECT_EQ(local.sin_port, bus.sin_port);
        EXPECT_NE(getpeername(socket, reinterpret_cast<sockaddr*>(&remote), &size), 0) << "connected";
        ++found.reservations;
      } else if (local.sin_port == bus.sin_port) {
        ++receivers;
      } else {
        ++found.senders;
        EXPECT_EQ(Option(socket, IPPROTO_IP, IP_MULTICAST_TTL), 0);
      }
    }
    close(socket);
  }
  // A process has at most one socket that receives; data sent to the port of a sender is never read.
  EXPECT_LE(receivers, 1);
  return found;
}

sockaddr_in AddressOf(const std::string& url) {
  sockaddr_in address{};
  const size_t host = std::strlen("udpm://"), colon = url.find(':', host);
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(std::stoi(url.substr(colon + 1))));
  EXPECT_EQ(inet_pton(AF_INET, url.substr(host, colon - host).c_str(), &address.sin_addr), 1);
  return address;
}

class Closed : public testing::Test {
 protected:
  std::vector<std::string> Command(const std::vector<std::string>& more) const {
    std::vector<std::string> command = {"evalbus", "run", "lift_pot/position", "--control-hz", "200",
                                        "--out",   run_,  "--episodes",        "50",           "--policy",
                                        "hold"};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  bool IsAtWork() const {
    std::error_code error;
    return fs::file_size(run_ / "episodes/0000.partial/events.lcmlog", error) > 100'000 && !error;
  }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};

TEST_F(Closed, ARunHasItsBusOpenAndSendsWithinThisMachine) {
  EVALBUS_NEEDS_BUS();
  const std::string url = ReservedBus::Draw().url();  // freed again so that the launcher can reserve it
  Program launcher(Command({"--url", url})), monitor({"evalbus-monitor", "--url", url}),
      viz({"evalbus-viz", "--url", url});
  // Both observers report when their buses are open.
  ASSERT_TRUE(WaitFor([&] {
    return IsAtWork() && monitor.out().find("listening to ") != std::string::npos &&
           viz.out().find("viz ready") != std::string::npos;
  })) << launcher.err();
  std::vector<pid_t> processes = ChildrenOf(launcher.pid());
  EXPECT_EQ(processes.size(), 5u);
  for (const Program* program : {&launcher, &monitor, &viz}) processes.push_back(program->pid());
  int senders = 0;
  for (const pid_t pid : processes) {
    const Sockets sockets = CheckSockets(pid, AddressOf(url));
    senders += sockets.senders;
    EXPECT_EQ(sockets.reservations, pid == launcher.pid() ? 1 : 0);
  }
  EXPECT_EQ(senders, 8);
}

// Sends one message repeatedly from another machine, which is a network namespace with a virtual cable to
// this one. Sends it to each of the buses, both to this machine's address on the cable and to the bus's
// group.
class Neighbor {
 public:
  explicit Neighbor(const std::vector<sockaddr_in>& buses) : pid_(fork()) {
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (unshare(CLONE_NEWNET) != 0) _exit(1);
    const std::string message("LC02\0\0\0\1EVALBUS_NEIGHBOR\0x", 27);
    const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    const int ttl = 1;
    setsockopt(socket, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    for (;; usleep(1000)) {
      for (sockaddr_in to : buses) {
        const auto* address = reinterpret_cast<const sockaddr*>(&to);
        sendto(socket, message.data(), message.size(), 0, address, sizeof to);
        inet_pton(AF_INET, kOurs, &to.sin_addr);
        sendto(socket, message.data(), message.size(), 0, address, sizeof to);
      }
    }
  }
  ~Neighbor() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Neighbor(const Neighbor&) = delete;
  Neighbor& operator=(const Neighbor&) = delete;

  bool Connect() const {
    const std::string pid = std::to_string(pid_), in = "nsenter -t " + pid + " -n ip ";
    // The namespace exists once it differs from the test's own.
    const auto network = [](const std::string& process) {
      std::error_code error;
      return fs::read_symlink("/proc/" + process + "/ns/net", error);
    };
    return WaitFor([&] { return network(pid) != network("self"); }) &&
           RunProgram({"sh", "-ec",
                       "ip link add cable type veth peer name cable netns " + pid + "; ip address add " +
                           kOurs + "/24 dev cable; ip link set cable up; " + in +
                           "address add 10.77.0.2/24 dev cable; " + in + "link set cable up; " + in +
                           "route add 224.0.0.0/4 dev cable"})
                   .code == 0;
  }

 private:
  static constexpr char kOurs[] = "10.77.0.1";
  pid_t pid_;
};

TEST_F(Closed, OtherMachinesAreReceivedOnlyIfTheUrlReachesThem) {
  try {
    EnterPrivateNetwork();
  } catch (const EnvironmentError& error) {
    GTEST_SKIP() << error.what();
  }
  const std::string url = UniqueUrl(), other = UniqueUrl();
  int received_here = 0, received_beyond = 0, received_own = 0;
  const auto count = [](int* received) {
    return [received](std::string_view, std::span<const uint8_t>, int64_t) { ++*received; };
  };
  Bus here(url), beyond(other.substr(0, other.find('?')) + "?ttl=1");
  here.SubscribeRaw("EVALBUS_NEIGHBOR", count(&received_here));
  here.SubscribeRaw("EVALBUS_OWN", count(&received_own));
  beyond.SubscribeRaw("EVALBUS_NEIGHBOR", count(&received_beyond));
  const Neighbor neighbor({AddressOf(url), AddressOf(other)});
  if (!neighbor.Connect()) GTEST_SKIP() << "no cable between network namespaces on this machine";
  EXPECT_TRUE(WaitFor([&] {
    beyond.Handle();
    return received_beyond > 20;
  }));
  const uint8_t byte = 0;
  here.PublishRaw("EVALBUS_OWN", {&byte, 1});
  EXPECT_TRUE(WaitFor([&] {
    here.Handle();
    return received_own > 0;
  }));
  EXPECT_EQ(received_here, 0);
}

TEST_F(Closed, OneProcessHasNothingOpen) {
  Program launcher(Command({"--in-process"}));
  ASSERT_TRUE(WaitFor([&] { return IsAtWork(); })) << launcher.err();
  const Sockets sockets = CheckSockets(launcher.pid(), {});
  EXPECT_EQ(sockets.senders, 0);
  EXPECT_EQ(sockets.reservations, 0);
}

}  // namespace evalbus::closed_test
