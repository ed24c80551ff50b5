// For LD_PRELOAD: a network that loses, repeats or reorders the UDP datagrams that a process receives.
// BAD_NETWORK names the fault and its frequency: "lose 40" loses every 40th datagram; "lose 40
// evalbus-recorder" does so in that program only.
#include <dlfcn.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

template <class Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

struct Network {
  Network() {
    const char* text = std::getenv("BAD_NETWORK");
    char name[16] = "", program[32] = "";
    const int words = text != nullptr ? std::sscanf(text, "%15s %ld %31s", name, &every, program) : 0;
    const bool is_meant = words == 3 ? std::strcmp(program, program_invocation_short_name) == 0 : words == 2;
    if (is_meant) kind = name;
  }
  std::string kind;
  long every = 1;
  long received = 0;
  // A datagram that this socket will receive again or late.
  int fd = -1;
  bool due = false;
  std::vector<char> held;
};

// One object is enough, because a bus reads in one thread.
Network& TheNetwork() {
  static Network network;
  return network;
}

// How long a delayed datagram waits for a datagram that overtakes it.
constexpr timespec kHold{0, 5'000'000};
// A datagram shorter than LCM's header is silently dropped.
constexpr unsigned kNothing = 1;

}  // namespace

extern "C" int ppoll(pollfd* fds, nfds_t count, const timespec* timeout, const __sigset_t* signals) {
  static auto* const next = Next<decltype(ppoll)>("ppoll");
  Network& network = TheNetwork();
  pollfd* const held =
      std::find_if(fds, fds + count, [&](const pollfd& one) { return one.fd == network.fd; });
  if (network.held.empty() || held == fds + count) return next(fds, count, timeout, signals);
  if (!network.due) {
    if (const int ready = next(fds, count, &kHold, signals); ready != 0) return ready;
    network.due = true;
  }
  for (pollfd* one = fds; one != fds + count; ++one) one->revents = 0;
  held->revents = POLLIN;
  return 1;
}

// Returns one datagram at a time, however many `batch` has room for.
extern "C" int recvmmsg(int fd, mmsghdr* batch, unsigned, int flags, timespec* timeout) {
  static auto* const next = Next<decltype(recvmmsg)>("recvmmsg");
  Network& network = TheNetwork();
  const iovec& buffer = batch->msg_hdr.msg_iov[0];
  if (!network.held.empty() && network.due && fd == network.fd) {
    batch->msg_len = static_cast<unsigned>(std::min(buffer.iov_len, network.held.size()));
    std::memcpy(buffer.iov_base, network.held.data(), batch->msg_len);
    batch->msg_hdr.msg_controllen = 0;
    network.held.clear();
    return 1;
  }
  const int received = next(fd, batch, 1, flags, timeout);
  if (received <= 0) return received;
  if (!network.held.empty()) {
    network.due = true;
    return received;
  }
  if (network.kind.empty() || ++network.received % network.every != 0) return received;
  if (network.kind != "lose") {
    const char* bytes = static_cast<const char*>(buffer.iov_base);
    network.held.assign(bytes, bytes + batch->msg_len);
    network.fd = fd;
    network.due = network.kind == "repeat";
  }
  if (!network.due) batch->msg_len = kNothing;
  return received;
}
