// Common base of the clients that use MessagePack over websockets.
#pragma once

#include <memory>
#include <string>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/websocket.h"

namespace evalbus::policy {

class WebsocketClient : public PolicyClient {
 public:
  bool connected() const final { return socket_ && socket_->open(); }

 protected:
  WebsocketClient(const ClientOptions& options, ArrayKeys array_keys);

  // Opens a new connection, which replaces the current one.
  void Open(const Deadline& deadline);
  // Returns the deadline of a request. The first request after connecting has more time.
  Deadline ForReply() const { return Deadline(answered_ ? options_.reply_s : options_.first_reply_s); }
  void Answered() { answered_ = true; }

  void Send(const Value& message, const Deadline& deadline);
  // Receives an answer. After the deadline, closes the connection and throws kTimeout, because a late answer
  // would be mistaken for the answer to the next request.
  Websocket::Message Receive(const Deadline& deadline);
  // Receives the server's first message. Throws kProtocol after the deadline, because a server that sends
  // nothing probably uses a wire on which the client speaks first.
  Value ReceiveFirst(const std::string& expected, const Deadline& deadline);
  std::optional<Websocket::Message> ReceiveNow() { return socket_ ? socket_->ReceiveNow() : std::nullopt; }

  // Decodes a message. If it is a text message (which reports an error) or not valid MessagePack, closes the
  // connection and throws.
  Value Decoded(const Websocket::Message& message);

  // Return an error to throw. Ended() closes the connection. ErrorFrom() reports the server's error message
  // and keeps the connection open.
  ServerError Ended(ServerError::Kind kind, const std::string& what);
  ServerError ErrorFrom(const std::string& words) const;

  const ClientOptions options_;

 private:
  const Url url_;
  const ArrayKeys array_keys_;
  std::unique_ptr<Websocket> socket_;
  bool answered_ = false;  // whether a request was answered on this connection
};

}  // namespace evalbus::policy
