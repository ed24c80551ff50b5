// For LD_PRELOAD: a network that loses, repeats or reorders what a process hears over UDP. BAD_NETWORK says
// what and how often: "lose 40" is every 40th datagram; "lose 40 evalbus-recorder" in that program only.
#include <dlfcn.h>
#include <sys/select.h>
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
  long heard = 0;
  // A datagram to be heard again or later, on this socket.
  int fd = -1;
  bool due = false;
  std::vector<char> held;
};

// liblcm hears in one thread.
Network& TheNetwork() {
  static Network network;
  return network;
}

// How long a datagram that is held back waits for one that overtakes it.
constexpr int kHoldUs = 5'000;
// liblcm drops what is shorter than its header without a word.
constexpr ssize_t kNothing = 1;

}  // namespace

extern "C" int select(int count, fd_set* reading, fd_set* writing, fd_set* failing, timeval* timeout) {
  static auto* const next = Next<decltype(select)>("select");
  Network& network = TheNetwork();
  if (network.held.empty() || reading == nullptr || !FD_ISSET(network.fd, reading)) {
    return next(count, reading, writing, failing, timeout);
  }
  if (!network.due) {
    fd_set wanted = *reading;
    timeval wait{0, kHoldUs};
    const int ready = next(count, &wanted, nullptr, nullptr, &wait);
    if (ready != 0) {
      *reading = wanted;
      return ready;
    }
    network.due = true;
  }
  FD_ZERO(reading);
  FD_SET(network.fd, reading);
  return 1;
}

extern "C" ssize_t recvmsg(int fd, msghdr* message, int flags) {
  static auto* const next = Next<decltype(recvmsg)>("recvmsg");
  Network& network = TheNetwork();
  iovec& buffer = message->msg_iov[0];
  if (!network.held.empty() && network.due && fd == network.fd) {
    const size_t size = std::min(buffer.iov_len, network.held.size());
    std::memcpy(buffer.iov_base, network.held.data(), size);
    message->msg_controllen = 0;
    network.held.clear();
    return static_cast<ssize_t>(size);
  }
  const ssize_t size = next(fd, message, flags);
  if (size <= 0) return size;
  if (!network.held.empty()) {
    network.due = true;
    return size;
  }
  if (network.kind.empty() || ++network.heard % network.every != 0) return size;
  if (network.kind == "lose") return kNothing;
  const char* bytes = static_cast<const char*>(buffer.iov_base);
  network.held.assign(bytes, bytes + size);
  network.fd = fd;
  network.due = network.kind == "repeat";
  return network.due ? size : kNothing;
}
