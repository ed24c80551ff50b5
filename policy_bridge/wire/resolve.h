// Addresses of a server by its name, by a deadline.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "policy_bridge/wire/url.h"

namespace evalbus::policy {

// Numeric addresses of a host, in the order in which they are to be tried. Throws std::runtime_error.
using Lookup = std::function<std::vector<std::string>(const std::string& host)>;

// The system's (getaddrinfo).
std::vector<std::string> LookUp(const std::string& host);

// Waits limit_s for `look_up`, which nothing can interrupt: it goes on alone, in a thread that nobody joins,
// and what it finds later is dropped. Throws ServerError (kUnreachable).
std::vector<std::string> Resolve(const Url& url, double limit_s, const Lookup& look_up = LookUp);

}  // namespace evalbus::policy
