// Address of a server: SCHEME://HOST:PORT[/TARGET].
#pragma once

#include <string>
#include <string_view>

namespace evalbus::policy {

struct Url {
  std::string text;    // as the user wrote it
  std::string host;    // a name or an address; an IPv6 address has no brackets
  std::string port;    // 1 to 65535
  std::string target;  // from the slash or the question mark on; empty if there is neither
};

// Parses a URL of this scheme. Throws InputError with the reason and an example of a valid URL.
Url ParseUrl(const std::string& text, std::string_view scheme);

}  // namespace evalbus::policy
