// Where a server is: SCHEME://HOST:PORT[/TARGET].
#pragma once

#include <string>
#include <string_view>

namespace evalbus::policy {

struct Url {
  std::string text;    // as the user wrote it
  std::string host;    // a name or an address; of IPv6, without the brackets
  std::string port;    // 1 to 65535
  std::string target;  // from the slash or the question mark on; empty if there is none
};

// Throws InputError, which says why and what a URL of this scheme looks like.
Url ParseUrl(const std::string& text, std::string_view scheme);

}  // namespace evalbus::policy
