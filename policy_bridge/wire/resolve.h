// Resolves a server's host name, with a deadline.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "policy_bridge/wire/url.h"

namespace evalbus::policy {

// Returns the numeric addresses of a host in the order in which to try them. Throws std::runtime_error.
using Lookup = std::function<std::vector<std::string>(const std::string& host)>;

// Uses the system's resolver (getaddrinfo).
std::vector<std::string> LookUp(const std::string& host);

// Resolves the host of `url` with `look_up`, and waits at most limit_s for it. `look_up` cannot be
// interrupted: after the deadline, it continues on a detached thread and its result is discarded. Throws
// ServerError (kUnreachable).
std::vector<std::string> Resolve(const Url& url, double limit_s, const Lookup& look_up = LookUp);

}  // namespace evalbus::policy
