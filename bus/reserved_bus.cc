#include "bus/reserved_bus.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <random>

#include "base/errors.h"
#include "bus/udpm/multicast_receiver.h"

namespace evalbus {
namespace {

// Unprivileged ports. Few services use ports of this range by default.
constexpr int kFirstPort = 20000, kLastPort = 59999;
constexpr int kMaxDraws = 1000;

// Returns a socket of this type, bound exclusively to the port; on failure, returns -1 and sets errno.
int BindAlone(int type, uint16_t port) {
  const int fd = socket(AF_INET, type | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    close(fd);
    errno = error;
    return -1;
  }
  return fd;
}

// Returns true if any program receives on this UDP port, even if it has not reserved its bus.
bool IsReceivedOn(uint16_t port) {
  const int fd = BindAlone(SOCK_DGRAM, port);
  if (fd >= 0) close(fd);
  return fd < 0 && errno == EADDRINUSE;
}

}  // namespace

ReservedBus& ReservedBus::operator=(ReservedBus&& other) noexcept {
  if (this == &other) return *this;
  Release();
  url_ = std::exchange(other.url_, {});
  socket_ = std::exchange(other.socket_, -1);
  return *this;
}

void ReservedBus::Release() {
  if (socket_ >= 0) close(std::exchange(socket_, -1));
}

ReservedBus::Place ReservedBus::DrawPlace() {
  std::random_device random;
  std::uniform_int_distribution<int> group(0, UINT16_MAX), port(kFirstPort, kLastPort);
  return {static_cast<uint16_t>(group(random)), static_cast<uint16_t>(port(random))};
}

ReservedBus ReservedBus::Draw(const std::function<Place()>& draw) {
  for (int i = 0; i < kMaxDraws; ++i) {
    const Place place = draw();
    ReservedBus bus(
        fmt::format("udpm://239.255.{}.{}:{}?ttl=0", place.group >> 8, place.group & 0xff, place.port));
    bus.socket_ = BindAlone(SOCK_STREAM, place.port);
    // If sockets cannot be created at all, opening the bus also fails and reports the reason.
    if (bus.socket_ < 0 && errno != EADDRINUSE) return bus;
    if (bus.socket_ >= 0 && !IsReceivedOn(place.port)) return bus;
  }
  throw EnvironmentError(fmt::format("no bus: all {} ports drawn between {} and {} are in use", kMaxDraws,
                                     kFirstPort, kLastPort));
}

ReservedBus ReservedBus::Chosen(const std::string& url) {
  ReservedBus bus(url);
  bus.socket_ = BindAlone(SOCK_STREAM, ParseMulticastUrl(url, 0).port);
  return bus;
}

}  // namespace evalbus
