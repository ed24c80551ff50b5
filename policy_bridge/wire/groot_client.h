// The client of NVIDIA Isaac-GR00T's inference servers, N1.5 to N1.7, over ZeroMQ.
//
// Every dialect is spoken to in one language. An observation is a map of "video.NAME" (|u1, (T, height,
// width, 3)), "state.NAME" (numbers, (T, D)) and language keys (text, keys as the server has them); an
// answer's actions are NAME (H, D). In Connect()'s map of modalities, the names of video, state and action
// are NAME too: a server of N1.5, which says "video.NAME" among the keys of video, loses that prefix there,
// so that in all dialects an observation's key is MODALITY.NAME. Language keys stay as they are, whatever
// dots they have.
//
// Deadlines: connect_s for the connection, first_reply_s for the first actions, reply_s for all else. The
// request to stop the server, which anybody may send it, is never sent.
#pragma once

#include <memory>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Does not connect yet. Throws InputError for a URL other than tcp://HOST:PORT.
std::unique_ptr<PolicyClient> MakeGrootClient(const ClientOptions& options);

}  // namespace evalbus::policy
