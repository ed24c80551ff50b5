// The clients of policy servers, one for each protocol. The top of each .cc file describes its protocol.
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Each function creates a client, which is not connected yet. Each throws InputError unless the URL has the
// form of its protocol: tcp://HOST:PORT for GR00T, http://HOST:PORT/PATH for REST (the default path is /act),
// otherwise ws://HOST:PORT/PATH.
std::unique_ptr<PolicyClient> MakeOpenpiClient(const ClientOptions& options);
std::unique_ptr<PolicyClient> MakeVlaEvalClient(const ClientOptions& options);
std::unique_ptr<PolicyClient> MakeGrootClient(const ClientOptions& options);
std::unique_ptr<PolicyClient> MakeRestClient(const ClientOptions& options);
std::unique_ptr<PolicyClient> MakeXPolicyLabClient(const ClientOptions& options);

}  // namespace evalbus::policy
