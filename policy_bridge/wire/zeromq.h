// Requests and answers over ZeroMQ, by deadlines.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// One connection of a REQ socket, which is not made again when it is lost: a request without one would wait
// for its deadline. One thread at a time.
class RequestSocket {
 public:
  // url: tcp://HOST:PORT or ipc://PATH. A longer answer than max_reply_bytes is refused before it is read.
  // Throws ServerError if there is no connection within connect_s.
  RequestSocket(std::string url, double connect_s, uint64_t max_reply_bytes);
  ~RequestSocket();

  // One frame there, one frame back. Throws ServerError; then the connection is of no use any more.
  Bytes Ask(const Bytes& request, double limit_s);

 private:
  struct Sockets;

  const std::string url_;
  const uint64_t max_reply_bytes_;
  const std::unique_ptr<Sockets> sockets_;
};

}  // namespace evalbus::policy
