// Version 1 of the protocol of vla-eval's model servers (github.com/allenai/vla-evaluation-harness,
// src/vla_eval/protocol, src/vla_eval/model_servers/serve.py).
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Connect() returns the payload of the server's hello: "model_server" and, if present, "action_spec" and
// "observation_spec". An error message leaves the connection open.
std::unique_ptr<PolicyClient> MakeVlaEvalClient(const ClientOptions& options);

}  // namespace evalbus::policy
