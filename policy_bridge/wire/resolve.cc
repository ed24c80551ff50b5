#include "policy_bridge/wire/resolve.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>
#include <thread>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

std::vector<std::string> LookUp(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    throw std::runtime_error(gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, freeaddrinfo);
  std::vector<std::string> addresses;
  for (const addrinfo* one = found; one; one = one->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    if (getnameinfo(one->ai_addr, one->ai_addrlen, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) == 0)
      addresses.emplace_back(text.data());
  }
  return addresses;
}

std::vector<std::string> Resolve(const Url& url, double limit_s, const Lookup& look_up) {
  std::packaged_task<std::vector<std::string>()> task([look_up, host = url.host] { return look_up(host); });
  auto addresses = task.get_future();
  std::thread(std::move(task)).detach();
  const std::chrono::duration<double> limit(std::clamp(limit_s, 0.0, 1e8));
  if (addresses.wait_for(limit) != std::future_status::ready) {
    throw ServerError(ServerError::Kind::kUnreachable,
                      fmt::format("{}: no name server answered within {} s", url.text, limit_s));
  }
  try {
    return addresses.get();
  } catch (const std::runtime_error& error) {
    throw ServerError(ServerError::Kind::kUnreachable,
                      fmt::format("{}: the host cannot be resolved ({})", url.text, error.what()));
  }
}

}  // namespace evalbus::policy
