// A bus on this machine that is reserved for one run.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace evalbus {

// All processes of a run share the UDP port of its bus, so binding that port does not show whether another
// run uses it. The launcher therefore also binds the TCP port of the same number, on which nothing listens.
// Only one process of a network namespace can bind it, independent of users and of pid and mount namespaces.
class ReservedBus {
 public:
  struct Place {
    // The last two bytes of the multicast address 239.255.x.y.
    uint16_t group = 0;
    uint16_t port = 0;
  };

  ReservedBus() = default;
  ~ReservedBus() { Release(); }
  ReservedBus(ReservedBus&& other) noexcept { *this = std::move(other); }
  ReservedBus& operator=(ReservedBus&& other) noexcept;

  // Draws groups and ports at random until one has a port that no other program in this network namespace
  // uses. draw: replaces the random draw in tests. Throws EnvironmentError if no free port is found. If no
  // socket can be created, returns a bus that is not reserved.
  static ReservedBus Draw(const std::function<Place()>& draw = DrawPlace);
  // Returns a bus that the user chose. Other programs may share it. Unless it is already reserved, it is
  // reserved so that Draw() of other runs does not choose it.
  static ReservedBus Chosen(const std::string& url);

  // Returns the URL of the bus; empty if there is no bus.
  const std::string& url() const { return url_; }

 private:
  static Place DrawPlace();
  explicit ReservedBus(std::string url) : url_(std::move(url)) {}
  void Release();

  std::string url_;
  // Socket bound to the TCP port; -1 if nothing is reserved.
  int socket_ = -1;
};

}  // namespace evalbus
