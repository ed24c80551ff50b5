// Interface of the clients of policy servers, independent of the wire.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// The server failed; no conclusion about the policy can be drawn. what() is one line. If the server sent an
// error message, what() contains it, or the last line of it if it is a traceback.
class ServerError : public std::runtime_error {
 public:
  enum class Kind {
    kUnreachable,  // connection refused or lost, unknown host
    kTimeout,      // no answer before the deadline
    kProtocol,     // invalid bytes on this wire: an incomplete or oversized frame, a different protocol
    kServer,       // the server reported a failure: an error message, a traceback
    kReply,        // keys or shapes of the answer differ from the contract
  };
  ServerError(Kind kind, const std::string& what, std::string details = {})
      : std::runtime_error(what), kind_(kind), details_(std::move(details)) {}
  Kind kind() const { return kind_; }
  // Returns the server's complete error message, possibly several lines; may be empty.
  const std::string& details() const { return details_; }

 private:
  Kind kind_;
  std::string details_;
};

enum class Wire { kOpenpi, kRoboArena, kVlaEval, kGroot, kRest, kXPolicyLab };

struct ClientOptions {
  Wire wire = Wire::kOpenpi;
  // The server's address: ws://HOST:PORT[/PATH] (openpi, RoboArena, vla-eval, XPolicyLab), tcp://HOST:PORT
  // (GR00T), http://HOST:PORT/PATH (REST).
  std::string url;
  // Sent as "Authorization: Api-Key KEY" (websockets, REST) or as api_token (GR00T). Empty: not sent.
  std::string api_key;
  // Address of the pool (policy_pool.h) that queries the server. Empty: this client queries the server
  // directly.
  std::string pool_url;
  // Deadlines, s. The first answer after a connection has its own deadline, because the server may compile
  // its model first.
  double connect_s = 10, first_reply_s = 600, reply_s = 30;
  // Maximum size of an answer. A larger answer is rejected before it is read.
  uint64_t max_reply_bytes = 256 << 20;
  // GR00T dialect. kDetect queries the server's names of inputs and outputs and derives the dialect from
  // them. Any other value skips this query.
  enum class GrootDialect { kDetect, kN15, kN16, kN16Flat };
  GrootDialect groot_dialect = GrootDialect::kDetect;
};

struct Reply {
  // The server's answer as a map, without the wire's envelope. If a wire has a single array of actions, its
  // key here is "actions", whatever the wire calls it. GR00T's arrays have the shape (H, D), without the
  // batch axis, and their names have no "action." prefix. XPolicyLab's list of H actions becomes one (H, D)
  // array for each key.
  Value value;
  // Wall-clock time of the inference as reported by the server. Unset if the server does not report it.
  std::optional<double> server_s;

  // Stores the time that a server reports, unless it is negative or not finite.
  void SetServerTime(double milliseconds) {
    if (milliseconds >= 0 && std::isfinite(milliseconds)) server_s = milliseconds / 1000;
  }
};

// All calls block, at most until the deadlines of ClientOptions. Not thread-safe. After a ServerError,
// Connect() must be called again unless connected() is still true, which depends on the wire and is possible
// only for kServer. This class does not interpret observations or actions.
class PolicyClient {
 public:
  virtual ~PolicyClient() = default;

  // Connects, and returns the server's description of itself: openpi's metadata, RoboArena's configuration,
  // vla-eval's hello payload, XPolicyLab's hello_ack payload, or GR00T's modality configuration (map of
  // modality to {"modality_keys": [...], ...}). Returns an empty map if the wire has no description. Throws
  // ServerError.
  virtual Value Connect() = 0;
  virtual bool connected() const = 0;

  // Begins an episode, so that the server discards the state of the previous one. RoboArena and GR00T: sends
  // a reset. vla-eval: sends episode_end, and episode_start with this task text. XPolicyLab: sends trial_end,
  // prepare_case (if the task text has changed) and reset. openpi: the wire has no such message, so each
  // episode uses a new connection. REST: does nothing, because servers have neither sessions nor state.
  // Throws ServerError.
  virtual void BeginEpisode(const std::string& instruction, int64_t episode) = 0;

  // Sends one observation and returns the answer. The observation is a map as built from the contract, with
  // the server's keys. For GR00T, they are "video.NAME", "state.NAME" and the language key, and the client
  // nests them if the dialect requires it. Throws ServerError.
  virtual Reply Infer(const Value& observation) = 0;

  // Sends several observations, and returns their answers in the same order. The observations are sent as one
  // request if the wire supports batches (GR00T) and their keys and shapes are equal, and otherwise one at a
  // time. Throws ServerError, which then applies to all of these observations.
  virtual std::vector<Reply> InferBatch(std::span<const Value> observations);

  // Returns the name of the wire and dialect in use, for messages, such as "openpi websocket" or "GR00T N1.6
  // (flat)".
  virtual std::string Name() const = 0;
};

// Creates a client, which is not connected yet. Throws InputError for a URL that does not fit the wire.
std::unique_ptr<PolicyClient> MakePolicyClient(const ClientOptions& options);

// Returns an error of kind kServer. what() contains the last line of the message or, of a Python traceback,
// the exception with its whole message, and details() all lines.
ServerError ErrorFromServer(const std::string& words);

}  // namespace evalbus::policy
