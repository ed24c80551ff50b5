// The wire of openpi's websocket policy server, and of those that speak like it
// (github.com/Physical-Intelligence/openpi, src/openpi/serving/websocket_policy_server.py), with RoboArena's
// dialect of it (github.com/robo-arena/roboarena, roboarena/policy_server.py).
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// The server begins with its metadata; then a request, a reply, in turns. An error is a text, and ends the
// connection. A server whose metadata have "action_space" speaks RoboArena's dialect, and Wire::kRoboArena
// says that it does anyway: "endpoint" in every request, a reset at the beginning of an episode, "session_id"
// where "needs_session_id" says so.
std::unique_ptr<PolicyClient> MakeOpenpiClient(const ClientOptions& options);

}  // namespace evalbus::policy
