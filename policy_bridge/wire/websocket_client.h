// What the clients of websockets that speak MessagePack have in common.
#pragma once

#include <memory>
#include <string>

#include "policy_bridge/wire/msgpack_codec.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/websocket.h"

namespace evalbus::policy {

class WebsocketClient : public PolicyClient {
 public:
  bool connected() const final { return socket_ && socket_->open(); }

 protected:
  WebsocketClient(const ClientOptions& options, ArrayKeys array_keys);

  // A new connection in place of what there was.
  void Open(const Deadline& deadline);
  // That of a request; the first one after a connection has longer.
  Deadline ForReply() const { return Deadline(answered_ ? options_.reply_s : options_.first_reply_s); }
  void Answered() { answered_ = true; }

  void Send(const Value& message, const Deadline& deadline);
  // Throws kTimeout after the deadline, which closes: a late answer would be taken for the next one's.
  Websocket::Message Receive(const Deadline& deadline);
  // What begins a conversation: kProtocol after the deadline, as another wire waits for us to begin.
  Value ReceiveFirst(const std::string& expected, const Deadline& deadline);
  std::optional<Websocket::Message> ReceiveNow() { return socket_ ? socket_->ReceiveNow() : std::nullopt; }

  // Closes and throws where it is a text, which says what went wrong, or no MessagePack.
  Value Decoded(const Websocket::Message& message);

  // An error to throw. Ended() closes; with Said(), the server's own words, the conversation goes on.
  ServerError Ended(ServerError::Kind kind, const std::string& what);
  ServerError Said(const std::string& words) const;

  const ClientOptions options_;

 private:
  const Url url_;
  const ArrayKeys array_keys_;
  std::unique_ptr<Websocket> socket_;
  bool answered_ = false;  // since it is connected
};

}  // namespace evalbus::policy
