// A bus of this machine that one run has for itself.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace evalbus {

// All processes of a run share the UDP port of its bus, so binding that port does not show whether another
// run uses it. The launcher therefore also binds the TCP port of the same number, on which nothing ever
// listens: only one process of a network namespace can, whatever its user and its pid and mount namespaces.
class ReservedBus {
 public:
  struct Place {
    // The last two bytes of a group 239.255.x.y.
    uint16_t group = 0;
    uint16_t port = 0;
  };

  // No bus.
  ReservedBus() = default;
  ~ReservedBus() { Release(); }
  ReservedBus(ReservedBus&& other) noexcept { *this = std::move(other); }
  ReservedBus& operator=(ReservedBus&& other) noexcept;

  // Draws places at random until no other program in this network namespace uses the port. draw: draws one,
  // for tests. Throws EnvironmentError where there is no free one.
  static ReservedBus Draw(const std::function<Place()>& draw = DrawPlace);
  // The bus that the user chose, which others may share: reserved against Draw() unless it already is.
  static ReservedBus Chosen(const std::string& url);

  // Empty without a bus.
  const std::string& url() const { return url_; }

 private:
  static Place DrawPlace();
  explicit ReservedBus(std::string url) : url_(std::move(url)) {}
  void Release();

  std::string url_;
  // -1: nothing is reserved.
  int socket_ = -1;
};

}  // namespace evalbus
