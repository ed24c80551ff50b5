// Where a server is: SCHEME://HOST:PORT[/TARGET].
#pragma once

#include <string>
#include <string_view>

namespace evalbus::policy {

struct Url {
  std::string host;    // without the brackets of IPv6
  std::string port;    // 1 to 65535
  std::string target;  // from the slash on; empty if there is none
};

// Throws InputError, which says what a URL of this scheme looks like.
Url ParseUrl(const std::string& text, std::string_view scheme);

}  // namespace evalbus::policy
