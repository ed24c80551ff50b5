// Address of a server: SCHEME://HOST:PORT[/TARGET].
#pragma once

#include <string>
#include <string_view>

namespace evalbus::policy {

struct Url {
  std::string text;    // as the user wrote it
  std::string host;    // a name or an address; IPv6 without the brackets
  std::string port;    // 1 to 65535
  std::string target;  // starts at the slash or the question mark; empty if there is none
};

// Throws InputError with the reason and an example of a URL of this scheme.
Url ParseUrl(const std::string& text, std::string_view scheme);

}  // namespace evalbus::policy
