#include "policy_bridge/wire/url.h"

#include <fmt/format.h>

#include <charconv>

#include "base/errors.h"

namespace evalbus::policy {

Url ParseUrl(const std::string& text, std::string_view scheme) {
  const auto refuse = [&] {
    throw InputError(fmt::format("{}: not the address of a server, {}://HOST:PORT", Printable(text), scheme));
  };
  const std::string before = fmt::format("{}://", scheme);
  if (!text.starts_with(before)) refuse();
  const size_t slash = std::min(text.find('/', before.size()), text.size());
  Url url;
  url.target = text.substr(slash);
  const std::string authority = text.substr(before.size(), slash - before.size());
  const size_t colon = authority.rfind(':');
  if (colon == std::string::npos) refuse();
  url.host = authority.substr(0, colon);
  url.port = authority.substr(colon + 1);
  if (url.host.starts_with('[') && url.host.ends_with(']')) {
    url.host = url.host.substr(1, url.host.size() - 2);
  } else if (url.host.find(':') != std::string::npos) {
    refuse();
  }
  int port = 0;
  const char* end = url.port.data() + url.port.size();
  if (std::from_chars(url.port.data(), end, port).ptr != end || port < 1 || port > 65535) refuse();
  // What would end a line of HTTP, or begin something else within it.
  if (url.host.empty() || text.find_first_of(std::string_view("\0 \t\r\n@#", 7)) != std::string::npos)
    refuse();
  return url;
}

}  // namespace evalbus::policy
