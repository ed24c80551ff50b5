// Client of policy servers that answer POST /act with json-numpy: OpenVLA, OpenVLA-OFT.
//
// An observation is sent as one JSON object with its keys in the map's order, which is the order of a model's
// inputs. An answer is one array (D,) or (H, D), or a list of H arrays (D,); Infer() returns it as "actions"
// (H, D). These servers have no session and do not describe themselves. Each request uses a new connection,
// because the servers close connections that are idle while the simulation runs.
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Does not connect yet; Connect() only checks that there is a server. Throws InputError for a URL other than
// http://HOST:PORT/PATH; the default path is /act.
std::unique_ptr<PolicyClient> MakeRestClient(const ClientOptions& options);

}  // namespace evalbus::policy
