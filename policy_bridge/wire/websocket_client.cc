#include "policy_bridge/wire/websocket_client.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

using Kind = ServerError::Kind;

WebsocketClient::WebsocketClient(const ClientOptions& options, ArrayKeys array_keys)
    : options_(options), url_(ParseUrl(options.url, "ws")), array_keys_(array_keys) {
  if (Printable(options.api_key) != options.api_key)
    throw InputError("an API key cannot contain control characters");
}

void WebsocketClient::Open(const Deadline& deadline) {
  socket_.reset();
  answered_ = false;
  socket_ = std::make_unique<Websocket>(url_, options_.api_key, options_.max_reply_bytes, deadline);
}

void WebsocketClient::Send(const Value& message, const Deadline& deadline) {
  if (!socket_) throw ServerError(Kind::kUnreachable, url_.text + ": not connected");
  socket_->Send(EncodeMsgpack(message, array_keys_), deadline);
}

Websocket::Message WebsocketClient::Receive(const Deadline& deadline) {
  std::optional<Websocket::Message> message = socket_->Receive(deadline);
  if (!message) throw Ended(Kind::kTimeout, fmt::format("no answer within {} s", deadline.seconds));
  return std::move(*message);
}

Value WebsocketClient::ReceiveFirst(const std::string& expected, const Deadline& deadline) {
  const std::optional<Websocket::Message> message = socket_->Receive(deadline);
  if (!message) {
    throw Ended(Kind::kProtocol, fmt::format("no {} within {} s: does the server use another wire protocol?",
                                             expected, deadline.seconds));
  }
  return Decoded(*message);
}

Value WebsocketClient::Decoded(const Websocket::Message& message) {
  if (message.is_text) {
    const ServerError error = ErrorFrom(message.Text());
    socket_.reset();
    throw error;
  }
  try {
    return DecodeMsgpack(message.bytes);
  } catch (const ServerError& error) {
    throw Ended(error.kind(), error.what());
  }
}

ServerError WebsocketClient::Ended(Kind kind, const std::string& what) {
  if (kind == Kind::kTimeout) socket_->Abort();  // a hung server would not answer a close frame
  socket_.reset();
  return {kind, url_.text + ": " + what};
}

ServerError WebsocketClient::ErrorFrom(const std::string& words) const {
  const ServerError error = ErrorFromServer(words);
  return {error.kind(), url_.text + ": " + error.what(), error.details()};
}

}  // namespace evalbus::policy
