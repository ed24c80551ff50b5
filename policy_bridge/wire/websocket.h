// A websocket (RFC 6455) to a policy server, as a client. Such a server may be silent for minutes, while it
// compiles, and so may we, while we simulate: neither side's silence is an error here, only a deadline is.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/url.h"
#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Of one exchange: what is sent for it, and all that is received.
struct Deadline {
  explicit Deadline(double after_s);
  double seconds;
  std::chrono::steady_clock::time_point time;
};

// Open until the first failure. One thread at a time. A thread within always has a read pending, which
// answers the server's pings; it sends none, as a server that computes answers none, and offers no
// compression.
class Websocket {
 public:
  struct Message {
    bool is_text = false;
    Bytes bytes;

    std::string Text() const { return {bytes.begin(), bytes.end()}; }
  };

  // Connects. The key, where there is one, is sent as "Authorization: Api-Key KEY". A message of more than
  // max_message_bytes is refused when it is announced. Throws ServerError.
  Websocket(Url url, const std::string& api_key, uint64_t max_message_bytes, const Deadline& deadline);
  // Says goodbye where it is open, and does not wait long for an answer.
  ~Websocket();

  bool open() const;

  // Sends a binary message. Throws ServerError where the connection has ended or ends, kTimeout after the
  // deadline, which ends it.
  void Send(Bytes message, const Deadline& deadline);

  // The next message, also if the connection has ended behind it; nothing after the deadline. Throws
  // ServerError where there is none any more: kUnreachable, or kProtocol for a message that is too long,
  // half, or none.
  std::optional<Message> Receive(const Deadline& deadline);

  // A message that is here already.
  std::optional<Message> ReceiveNow();

  // Ends the connection at once, without a word.
  void Abort();

 private:
  struct Connection;
  const Url url_;
  const std::unique_ptr<Connection> connection_;
};

}  // namespace evalbus::policy
