#include "policy_bridge/wire/zeromq.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <tuple>
#include <utility>
#include <zmq.hpp>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;
using Clock = std::chrono::steady_clock;

Clock::time_point In(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

// The socket for requests, and the socket that reports the state of its connection.
struct RequestSocket::Sockets {
  // Stops the monitor, because an event that is not received would block ZeroMQ's thread forever.
  ~Sockets() { zmq_socket_monitor(requests.handle(), nullptr, 0); }

  // Waits for an answer or an event. Returns false if neither arrives before the deadline.
  bool Wait(Clock::time_point deadline) {
    while (true) {
      std::array<zmq::pollitem_t, 2> items = {
          {{requests.handle(), 0, ZMQ_POLLIN, 0}, {events.handle(), 0, ZMQ_POLLIN, 0}}};
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      try {
        if (zmq::poll(items.data(), items.size(), std::max(left, std::chrono::milliseconds(0))) > 0)
          return true;
        if (Clock::now() >= deadline) return false;
      } catch (const zmq::error_t& error) {
        if (error.num() != EINTR) throw;
      }
    }
  }

  // Returns the next event, or 0 if there is none.
  int NextEvent() {
    zmq::message_t event, address;
    if (!events.recv(event, zmq::recv_flags::dontwait) || event.size() < sizeof(uint16_t)) return 0;
    if (event.more()) std::ignore = events.recv(address, zmq::recv_flags::none);
    uint16_t number = 0;
    std::memcpy(&number, event.data(), sizeof number);
    return number;
  }

  zmq::context_t context{1};
  zmq::socket_t requests{context, zmq::socket_type::req}, events{context, zmq::socket_type::pair};
};

RequestSocket::RequestSocket(std::string url, double connect_s, uint64_t max_reply_bytes)
    : url_(std::move(url)), max_reply_bytes_(max_reply_bytes), sockets_(std::make_unique<Sockets>()) {
  zmq::socket_t &requests = sockets_->requests, &events = sockets_->events;
  requests.set(zmq::sockopt::linger, 0);
  requests.set(zmq::sockopt::ipv6, true);
  requests.set(zmq::sockopt::reconnect_ivl, -1);
  requests.set(zmq::sockopt::maxmsgsize, static_cast<int64_t>(max_reply_bytes));
  events.set(zmq::sockopt::linger, 0);
  constexpr const char* kEvents = "inproc://events";
  if (zmq_socket_monitor(requests.handle(), kEvents,
                         ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                             ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                             ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED) != 0) {
    throw zmq::error_t();
  }
  events.connect(kEvents);
  try {
    requests.connect(url_);
  } catch (const zmq::error_t& error) {
    throw ServerError(Kind::kUnreachable, fmt::format("{}: {}", url_, error.what()));
  }
  if (!sockets_->Wait(In(connect_s))) {
    throw ServerError(Kind::kTimeout, fmt::format("{}: no connection in {} s", url_, connect_s));
  }
  switch (sockets_->NextEvent()) {
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      return;
    case ZMQ_EVENT_CLOSED:
      throw ServerError(Kind::kUnreachable, url_ + ": no server there");
    default:
      throw ServerError(Kind::kProtocol, url_ + ": the server that answers there is not a ZeroMQ server");
  }
}

RequestSocket::~RequestSocket() = default;

Bytes RequestSocket::Call(const Bytes& request, double limit_s) {
  const auto lost = [this](const std::string& how) {
    throw ServerError(Kind::kUnreachable, fmt::format("{}: the connection ended {}", url_, how));
  };
  const Clock::time_point deadline = In(limit_s);
  if (!sockets_->requests.send(zmq::buffer(request), zmq::send_flags::dontwait))
    lost("before the request was sent");
  zmq::message_t reply;
  while (true) {
    if (!sockets_->Wait(deadline)) {
      throw ServerError(Kind::kTimeout, fmt::format("{}: no answer in {} s", url_, limit_s));
    }
    // Answers are checked before the events, because an answer that the server sent before it disconnected is
    // valid.
    if (sockets_->requests.recv(reply, zmq::recv_flags::dontwait)) break;
    if (sockets_->NextEvent() != 0) {
      lost(fmt::format("without an answer, or after an answer of more than {} bytes", max_reply_bytes_));
    }
  }
  if (reply.more()) throw ServerError(Kind::kProtocol, url_ + ": an answer of several frames, expected one");
  const auto* begin = reply.data<uint8_t>();
  return {begin, begin + reply.size()};
}

}  // namespace evalbus::policy
