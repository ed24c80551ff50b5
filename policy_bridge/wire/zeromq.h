// Requests and answers over ZeroMQ, with deadlines.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// A REQ socket with a single connection. It does not reconnect after a loss, because a request would then
// wait for a connection until its deadline. Not thread-safe.
class RequestSocket {
 public:
  // url: tcp://HOST:PORT or ipc://PATH. An answer of more than max_reply_bytes is rejected before it is read.
  // Throws ServerError if the connection is not established within connect_s.
  RequestSocket(std::string url, double connect_s, uint64_t max_reply_bytes);
  ~RequestSocket();

  // Sends one frame and receives one frame. Must not be called again after a ServerError.
  Bytes Call(const Bytes& request, double limit_s);

 private:
  struct Sockets;

  const std::string url_;
  const uint64_t max_reply_bytes_;
  const std::unique_ptr<Sockets> sockets_;
};

}  // namespace evalbus::policy
