// The client of policy servers that answer POST /act with json-numpy: OpenVLA's, OpenVLA-OFT's.
//
// An observation is sent as one JSON object with its keys in the map's order, which is the order of a model's
// inputs. An answer is one array (D,) or (H, D), or a list of H arrays (D,); Infer() has it as "actions" (H,
// D). These servers have no session and say nothing of themselves. A connection lasts for one request, since
// they close one that a simulation leaves idle.
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Does not connect yet; Connect() only sees whether there is a server. Throws InputError for a URL other than
// http://HOST:PORT/PATH; without a path it is /act.
std::unique_ptr<PolicyClient> MakeRestClient(const ClientOptions& options);

}  // namespace evalbus::policy
