// No two runs reserve the same bus. The ports belong to this network namespace, and other processes may use
// any of them. Therefore the tests use ports that ReservedBus::Draw() or the system chose.
#include "bus/reserved_bus.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <set>
#include <vector>

#include "base/errors.h"
#include "bus/udpm/multicast_receiver.h"

namespace evalbus::reserved_bus_test {

uint16_t PortOf(const std::string& url) { return ParseMulticastUrl(url, 0).port; }

// A program that receives on a port and allows others to receive there, as LCM programs do.
class OtherProgram {
 public:
  OtherProgram() {
    const int yes = 1;
    EXPECT_EQ(setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes), 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~OtherProgram() { close(socket_); }
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;
  uint16_t port() const { return port_; }

 private:
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  uint16_t port_ = 0;
};

// Returns a function that returns these ports one after the other, each with a different multicast group.
std::function<ReservedBus::Place()> Draws(std::vector<uint16_t> ports) {
  return [ports = std::move(ports), next = size_t{0}]() mutable {
    const uint16_t port = ports[next % ports.size()];
    return ReservedBus::Place{static_cast<uint16_t>(0x0200 + next++), port};
  };
}

TEST(ReservedBus, DrawsAnUnusedBus) {
  const ReservedBus first = ReservedBus::Draw();
  const OtherProgram other;
  ReservedBus free = ReservedBus::Draw();
  const uint16_t free_port = PortOf(free.url());
  free = {};
  const ReservedBus drawn =
      ReservedBus::Draw(Draws({PortOf(first.url()), other.port(), PortOf(first.url()), free_port}));
  EXPECT_EQ(drawn.url(), "udpm://239.255.2.3:" + std::to_string(free_port) + "?ttl=0");
}

TEST(ReservedBus, IsFreeOnceItsOwnerIsGone) {
  const ReservedBus::Place place{1, PortOf(ReservedBus::Draw().url())};
  for (int i = 0; i < 2; ++i) {
    const ReservedBus bus = ReservedBus::Draw([&] { return place; });
    ReservedBus moved = ReservedBus::Chosen(bus.url());
    EXPECT_EQ(moved.url(), bus.url()) << "a bus that is named explicitly may be shared";
    EXPECT_THROW(ReservedBus::Draw([&] { return place; }), EnvironmentError);
  }
}

TEST(ReservedBus, WhatTheUserChoseIsNotDrawn) {
  const std::string url = ReservedBus::Draw().url();
  const ReservedBus chosen = ReservedBus::Chosen(url);
  EXPECT_THROW(ReservedBus::Draw(Draws({PortOf(url)})), EnvironmentError);
}

TEST(ReservedBus, IsDrawnFromManyPlaces) {
  std::vector<ReservedBus> buses;
  std::set<uint16_t> ports;
  for (int i = 0; i < 200; ++i) {
    buses.push_back(ReservedBus::Draw());
    ports.insert(PortOf(buses.back().url()));
  }
  EXPECT_EQ(ports.size(), buses.size());
  EXPECT_GE(*ports.begin(), 20000);
  EXPECT_LE(*ports.rbegin(), 59999);
}

}  // namespace evalbus::reserved_bus_test
