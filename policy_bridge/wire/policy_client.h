// A conversation with a policy server, the same whatever the wire.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// The server is no use to us; says nothing of its policy. what() is one line, with the server's own words
// where it said any (their last line, where they are a traceback).
class ServerError : public std::runtime_error {
 public:
  enum class Kind {
    kUnreachable,  // refused, no such host, gone
    kTimeout,      // no answer in time
    kProtocol,     // bytes that this wire does not have: half a frame, too long a one, another protocol
    kServer,       // it says that it failed: an error message, a traceback
    kReply,        // decodes, and is not what the contract says: keys, shapes
  };
  ServerError(Kind kind, const std::string& what, std::string details = {})
      : std::runtime_error(what), kind_(kind), details_(std::move(details)) {}
  Kind kind() const { return kind_; }
  // All that the server said, of many lines; may be empty.
  const std::string& details() const { return details_; }

 private:
  Kind kind_;
  std::string details_;
};

enum class Wire { kOpenpi, kRoboArena, kVlaEval, kGroot, kRest };

struct ClientOptions {
  Wire wire = Wire::kOpenpi;
  // ws://HOST:PORT[/PATH] (openpi, RoboArena, vla-eval), tcp://HOST:PORT (GR00T), http://HOST:PORT/PATH
  // (REST).
  std::string url;
  // Sent as "Authorization: Api-Key KEY" (websockets, REST) or as api_token (GR00T); empty: nothing is sent.
  std::string api_key;
  // Of the pool (policy_pool.h) that speaks to the server; empty: this client does.
  std::string pool_url;
  // Deadlines, s. The first answer after a connection is that of a server that compiles its model.
  double connect_s = 10, first_reply_s = 600, reply_s = 30;
  // A longer answer is refused before it is read.
  uint64_t max_reply_bytes = 256 << 20;
  // GR00T: what the server calls its inputs and outputs tells the dialect; given here, it is not asked.
  enum class GrootDialect { kDetect, kN15, kN16, kN16Flat };
  GrootDialect groot_dialect = GrootDialect::kDetect;
};

struct Reply {
  // Map of what the server says, without the wire's envelope. Where a wire has one array of actions it is
  // under "actions", whatever the wire calls it; GR00T's arrays have their names without "action." and are
  // (H, D), without the batch.
  Value value;
  // Wall-clock time that the server says its inference took; nothing where it does not say.
  std::optional<double> server_s;
};

// Blocking, by the deadlines of ClientOptions; one thread at a time. After a ServerError of any kind but
// kServer on a wire that survives it, the client is closed: Connect() begins anew. Nothing of this class
// looks at what an observation or an action means.
class PolicyClient {
 public:
  virtual ~PolicyClient() = default;

  // Connects, and returns what the server says of itself: openpi's metadata, RoboArena's configuration,
  // vla-eval's hello payload, GR00T's modality configuration (map of modality to {"modality_keys": [...],
  // ...}); an empty map where the wire has nothing of the kind. Throws ServerError.
  virtual Value Connect() = 0;
  virtual bool connected() const = 0;

  // Begins an episode: the server forgets what it keeps of the last one. Sends the wire's message for that
  // (RoboArena's and GR00T's reset, vla-eval's episode_end and episode_start with this task text); openpi's
  // wire has none, so that each episode has a connection of its own. Does nothing on the REST wire, whose
  // servers know neither. Throws ServerError.
  virtual void BeginEpisode(const std::string& instruction, int64_t episode) = 0;

  // One observation, a map as the contract builds it (keys as the server names them; GR00T: "video.NAME",
  // "state.NAME", language key, which the client nests where the dialect wants that). Throws ServerError.
  virtual Reply Infer(const Value& observation) = 0;

  // Several, each answered by itself, in their order: one request where the wire has a batch (GR00T) and
  // their keys and shapes are the same, else one after the other. Throws ServerError, which concerns all.
  virtual std::vector<Reply> InferBatch(std::span<const Value> observations);

  // The wire's own name for the path taken, for people: "openpi websocket", "GR00T N1.6 (flat)".
  virtual std::string Name() const = 0;
};

// Does not connect yet. Throws InputError for a URL that is none of this wire.
std::unique_ptr<PolicyClient> MakePolicyClient(const ClientOptions& options);

}  // namespace evalbus::policy
