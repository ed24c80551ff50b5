// Client of NVIDIA Isaac-GR00T's inference servers, N1.5 to N1.7, over ZeroMQ.
//
// The interface is the same for every dialect. An observation is a map of "video.NAME" (|u1, (T, height,
// width, 3)), "state.NAME" (numbers, (T, D)) and language keys (text, with the server's keys). The actions of
// an answer are NAME (H, D). In the map of modalities that Connect() returns, the names of video, state and
// action have no prefix either: an N1.5 server lists "video.NAME" under video, and the prefix is removed. So
// the key of an observation is MODALITY.NAME in all dialects. Language keys are not changed, even if they
// contain dots.
//
// Deadlines: connect_s for the connection, first_reply_s for the first actions, reply_s for all other
// answers. The client never sends the request to stop the server, although the protocol allows any client to
// send it.
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Does not connect yet. Throws InputError for a URL other than tcp://HOST:PORT.
std::unique_ptr<PolicyClient> MakeGrootClient(const ClientOptions& options);

}  // namespace evalbus::policy
