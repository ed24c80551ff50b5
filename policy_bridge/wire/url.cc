#include "policy_bridge/wire/url.h"

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

#include "base/errors.h"
#include "base/number_from.h"
#include "base/text.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

Url ParseUrl(const std::string& text, std::string_view scheme) {
  const auto refuse = [&](const char* why) {
    throw InputError(fmt::format("{}: {}; expected {}://HOST:PORT", Printable(text), why, scheme));
  };
  const std::string before = fmt::format("{}://", scheme);
  if (text.starts_with("wss://") || text.starts_with("https://")) {
    refuse("TLS is not supported; use a proxy that terminates it, or a tunnel (ssh -L)");
  }
  if (!text.starts_with(before)) refuse("wrong scheme");
  // Rejects characters that would end a line of HTTP, or begin another element in it.
  if (Printable(text) != text || text.find_first_of(" #") != std::string::npos) {
    refuse("it has a space, a # or a control character");
  }
  const size_t end = std::min(text.find_first_of("/?", before.size()), text.size());
  const std::string authority = text.substr(before.size(), end - before.size());
  Url url{.text = text, .host = {}, .port = {}, .target = text.substr(end)};
  if (authority.find('@') != std::string::npos)
    refuse("it has a user name or password, which would not be sent");
  const size_t colon = authority.rfind(':');
  const bool is_ipv6 = authority.starts_with('[');
  if (colon == std::string::npos || (is_ipv6 && authority[colon - 1] != ']')) refuse("no port");
  url.port = authority.substr(colon + 1);
  url.host = is_ipv6 ? authority.substr(1, colon - 2) : authority.substr(0, colon);
  if (url.host.empty()) refuse("no host");
  if (!is_ipv6 && url.host.find(':') != std::string::npos) refuse("an IPv6 address must be in []");
  const int port = NumberFrom<int>(url.port).value_or(0);
  if (port < 1 || port > 65535) refuse("not a valid port");
  return url;
}

bool IsLoopback(const std::string& url) {
  const std::string scheme = url.substr(0, url.find("://"));
  if (scheme == "ipc") return true;
  const std::string host = ParseUrl(url, scheme).host;
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

std::string HostAndPort(const std::string& host, const std::string& port) {
  return (host.find(':') == std::string::npos ? host : '[' + host + ']') + ':' + port;
}

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
