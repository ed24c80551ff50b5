// Client side of a websocket (RFC 6455) to a policy server. The server may be silent for minutes while it
// compiles its model, and the client while it simulates. Silence is therefore not an error, but a missed
// deadline is.
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

// Deadline of one exchange, which consists of sending a request and receiving its complete answer.
struct Deadline {
  explicit Deadline(double after_s);
  double seconds;
  std::chrono::steady_clock::time_point time;
};

// The websocket is open until the first failure. Not thread-safe. An internal thread always has a read
// pending, which also answers the server's pings. The client sends no pings, because a server does not answer
// them while it computes. It offers no compression.
class Websocket {
 public:
  struct Message {
    bool is_text = false;
    Bytes bytes;

    std::string Text() const { return {bytes.begin(), bytes.end()}; }
  };

  // Connects. If api_key is not empty, it is sent as "Authorization: Api-Key KEY". A message of more than
  // max_message_bytes is rejected as soon as its length is announced. Throws ServerError.
  Websocket(Url url, const std::string& api_key, uint64_t max_message_bytes, const Deadline& deadline);
  // If the connection is open, sends a close frame and waits briefly for the answer.
  ~Websocket();

  bool open() const;

  // Sends a binary message. If the connection is closed or is lost meanwhile, throws ServerError, unless
  // received messages are waiting. Throws kTimeout and closes the connection after the deadline.
  void Send(Bytes message, const Deadline& deadline);

  // Returns the next message, even if the connection was closed after it. Returns nullopt if the deadline
  // passes. Throws ServerError if there are no more messages: kUnreachable, or kProtocol for a message that
  // is too long, incomplete or invalid.
  std::optional<Message> Receive(const Deadline& deadline);

  // Returns a message that has already been received, or nothing. Does not wait.
  std::optional<Message> ReceiveNow();

  // Closes the connection immediately, without a close frame.
  void Abort();

 private:
  struct Connection;
  const Url url_;
  const std::unique_ptr<Connection> connection_;
};

}  // namespace evalbus::policy
