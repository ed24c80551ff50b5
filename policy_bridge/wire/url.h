// Address of a server: SCHEME://HOST:PORT[/TARGET].
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace evalbus::policy {

struct Url {
  std::string text;    // as the user wrote it
  std::string host;    // a name or an address; an IPv6 address has no brackets
  std::string port;    // 1 to 65535
  std::string target;  // from the slash or the question mark on; empty if there is neither
};

// Parses a URL of this scheme. Throws InputError with the reason and an example of a valid URL.
Url ParseUrl(const std::string& text, std::string_view scheme);

// Returns whether the address (SCHEME://...) is valid only on the machine that uses it: a loopback address,
// or ipc://PATH. Throws the errors of ParseUrl().
bool IsLoopback(const std::string& url);

// Returns HOST:PORT, with an IPv6 address in brackets.
std::string HostAndPort(const std::string& host, const std::string& port);

// Returns the numeric addresses of a host in the order in which to try them. Throws std::runtime_error.
using Lookup = std::function<std::vector<std::string>(const std::string& host)>;

// Uses the system's resolver (getaddrinfo).
std::vector<std::string> LookUp(const std::string& host);

// Resolves the host of `url` with `look_up`, and waits at most limit_s for it. `look_up` cannot be
// interrupted: after the deadline, it continues on a detached thread and its result is discarded. Throws
// ServerError (kUnreachable).
std::vector<std::string> Resolve(const Url& url, double limit_s, const Lookup& look_up = LookUp);

}  // namespace evalbus::policy
