// Protocol of openpi's websocket policy server and compatible servers
// (github.com/Physical-Intelligence/openpi, src/openpi/serving/websocket_policy_server.py), and RoboArena's
// dialect of it (github.com/robo-arena/roboarena, roboarena/policy_server.py).
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// The server first sends its metadata; then requests and replies alternate. An error is sent as a text and
// ends the connection. RoboArena's dialect is used if the server's metadata contain "action_space", or if the
// wire is Wire::kRoboArena: "endpoint" in every request, a reset at the beginning of an episode, and
// "session_id" if "needs_session_id" is set.
std::unique_ptr<PolicyClient> MakeOpenpiClient(const ClientOptions& options);

}  // namespace evalbus::policy
