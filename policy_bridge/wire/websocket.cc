#include "policy_bridge/wire/websocket.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "base/text.h"
#include "policy_bridge/wire/url.h"

namespace evalbus::policy {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using Kind = ServerError::Kind;

// This distinct socket type exists because Beast selects by the type how a connection is torn down. Beast's
// default reads everything that the server still sends. This may be much (a rejected message of 2 GB) or
// endless.
class Socket : public asio::ip::tcp::socket {
 public:
  using asio::ip::tcp::socket::socket;

  template <class Handler>
  friend void async_teardown(beast::role_type, Socket& socket, Handler&& handler) {
    error_code error;
    socket.close(error);
    asio::post(socket.get_executor(), beast::bind_front_handler(std::forward<Handler>(handler), error));
  }
};

// Maximum number of received messages that have not been taken. Usually there is at most one, but an error
// and its explanation may arrive together.
constexpr size_t kMaxWaiting = 16;

constexpr auto kGoodbye = std::chrono::seconds(1);

}  // namespace

Deadline::Deadline(double after_s)
    : seconds(after_s),
      time(std::chrono::steady_clock::now() +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(
               std::chrono::duration<double>(std::clamp(after_s, 0.0, 1e8)))) {}

struct Websocket::Connection {
  explicit Connection(const Url& the_url, uint64_t the_limit) : url(the_url), limit(the_limit) {}

  // The members below run on the I/O thread.

  void Open() {
    asio::async_connect(stream.next_layer(), endpoints, [this](error_code error, const auto&) {
      if (error == asio::error::connection_refused) {
        return Fail(Kind::kUnreachable, "connection refused: is the policy server running there?");
      }
      if (error) return Fail(Kind::kUnreachable, error.message());
      Handshake();
    });
  }

  void Handshake() {
    {
      const std::lock_guard lock(mutex);
      stage = "no answer to the websocket handshake";
    }
    error_code ignored;
    stream.next_layer().set_option(asio::ip::tcp::no_delay(true), ignored);
    stream.set_option(websocket::stream_base::timeout{
        websocket::stream_base::none(), websocket::stream_base::none(), /*keep_alive_pings=*/false});
    websocket::permessage_deflate no_deflate;
    no_deflate.client_enable = no_deflate.server_enable = false;
    stream.set_option(no_deflate);
    stream.set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
      request.set(http::field::user_agent, "evalbus");
      if (!api_key.empty()) request.set(http::field::authorization, "Api-Key " + api_key);
    }));
    stream.read_message_max(limit);
    stream.binary(true);
    stream.auto_fragment(false);
    stream.write_buffer_bytes(64 << 10);
    stream.async_handshake(response, HostAndPort(url.host, url.port),
                           url.target.starts_with('/') ? url.target : "/" + url.target,
                           [this](error_code error) {
                             if (error) return FailHandshake(error);
                             {
                               const std::lock_guard lock(mutex);
                               connected = true;
                             }
                             changed.notify_all();
                             Read();
                           });
  }

  void FailHandshake(const error_code& error) {
    if (error != websocket::error::upgrade_declined) {
      return Fail(Kind::kProtocol, fmt::format("no websocket answers there ({})", error.message()));
    }
    const int status = static_cast<int>(response.result_int());
    const std::string answer = fmt::format("HTTP {} {}", status, Printable(std::string(response.reason())));
    // A proxy reports with these codes that the server behind it is down.
    if (status >= 502 && status <= 504)
      return Fail(Kind::kUnreachable, answer + ": the server behind this proxy is down");
    if (status == 401 || status == 403) return Fail(Kind::kServer, answer + ": is the API key right?");
    Fail(Kind::kProtocol, answer + " and no websocket: is the path right?");
  }

  void Read() {
    stream.async_read(buffer, [this](error_code error, size_t) {
      if (error) return FailRead(error);
      bool too_many;
      {
        const std::lock_guard lock(mutex);
        const auto* bytes = static_cast<const uint8_t*>(buffer.data().data());
        waiting.push_back({stream.got_text(), Bytes(bytes, bytes + buffer.size())});
        waiting_bytes += buffer.size();
        too_many = waiting.size() > kMaxWaiting || waiting_bytes > limit;
      }
      changed.notify_all();
      buffer.consume(buffer.size());
      if (too_many) return Fail(Kind::kProtocol, "the server keeps sending unexpected messages");
      Read();
    });
  }

  void FailRead(const error_code& error) {
    if (error == websocket::error::closed) {
      const websocket::close_reason& reason = stream.reason();
      return Fail(
          Kind::kUnreachable,
          fmt::format("the server closed the connection ({}{}{})", static_cast<int>(reason.code),
                      reason.reason.empty() ? "" : ": ", Printable(std::string(reason.reason.c_str()))));
    }
    if (error == websocket::error::message_too_big) {
      return Fail(Kind::kProtocol, fmt::format("an answer of more than {} bytes, which is the limit", limit));
    }
    if (error == websocket::condition::protocol_violation) {
      return Fail(Kind::kProtocol, fmt::format("not a websocket message ({})", error.message()));
    }
    if (!stream.is_message_done())
      return Fail(Kind::kProtocol, "the connection ended in the middle of a message");
    Fail(Kind::kUnreachable, fmt::format("the connection was lost ({})", error.message()));
  }

  void Fail(Kind kind, const std::string& why) {
    error_code ignored;
    stream.next_layer().close(ignored);
    {
      const std::lock_guard lock(mutex);
      if (!failure) failure = ServerError(kind, url.text + ": " + why);
    }
    changed.notify_all();
  }

  void Run() {
    try {
      context.run();
    } catch (const std::exception& error) {  // out of memory
      Fail(Kind::kProtocol, error.what());
    }
  }

  // The members below run on the caller's thread.

  template <class Condition>
  bool Wait(std::unique_lock<std::mutex>* lock, const Deadline& deadline, const Condition& condition) {
    return changed.wait_until(*lock, deadline.time, condition);
  }

  void Stop(const std::string& why, Kind kind) {
    context.stop();
    if (thread.joinable()) thread.join();
    Fail(kind, why);
  }

  Websocket::Message Take() {
    Message message = std::move(waiting.front());
    waiting.pop_front();
    waiting_bytes -= message.bytes.size();
    return message;
  }

  const Url& url;
  const uint64_t limit;
  std::string api_key;
  asio::io_context context{1};
  std::vector<asio::ip::tcp::endpoint> endpoints;
  websocket::stream<Socket> stream{context};
  websocket::response_type response;
  beast::flat_buffer buffer;
  Bytes outgoing;

  // State shared by both threads.
  std::mutex mutex;
  std::condition_variable changed;
  const char* stage = "no connection";
  bool connected = false, sent = false;
  std::deque<Message> waiting;
  uint64_t waiting_bytes = 0;
  std::optional<ServerError> failure;

  std::thread thread;
};

Websocket::Websocket(Url url, const std::string& api_key, uint64_t max_message_bytes,
                     const Deadline& deadline)
    : url_(std::move(url)), connection_(std::make_unique<Connection>(url_, max_message_bytes)) {
  Connection& to = *connection_;
  to.api_key = api_key;
  for (const std::string& address : Resolve(url_, deadline.seconds)) {
    to.endpoints.emplace_back(asio::ip::make_address(address), static_cast<uint16_t>(std::stoi(url_.port)));
  }
  to.Open();
  to.thread = std::thread([&to] { to.Run(); });
  std::unique_lock lock(to.mutex);
  const bool in_time = to.Wait(&lock, deadline, [&] { return to.connected || to.failure; });
  const std::string late = fmt::format("{} within {} s", to.stage, deadline.seconds);
  const bool was_connected = to.connected;
  lock.unlock();
  if (!in_time) to.Stop(late, Kind::kTimeout);
  // If the connection was established, messages that the server sent before it closed the connection can
  // still be received.
  if (!was_connected) {
    Abort();
    throw ServerError(*to.failure);
  }
}

Websocket::~Websocket() {
  Connection& to = *connection_;
  if (open()) {
    asio::post(to.context,
               [&to] { to.stream.async_close(websocket::close_code::normal, [](error_code) {}); });
    std::unique_lock lock(to.mutex);
    // The server's close frame ends the pending read.
    to.changed.wait_for(lock, kGoodbye, [&] { return to.failure.has_value(); });
  }
  Abort();
}

bool Websocket::open() const {
  const std::lock_guard lock(connection_->mutex);
  return !connection_->failure;
}

void Websocket::Send(Bytes message, const Deadline& deadline) {
  Connection& to = *connection_;
  std::unique_lock lock(to.mutex);
  // If there are messages that the server sent before it closed the connection, they can still be received.
  // The same applies to the failure of the write below.
  if (to.failure && to.waiting.empty()) throw ServerError(*to.failure);
  if (to.failure) return;
  to.sent = false;
  to.outgoing = std::move(message);
  asio::post(to.context, [&to] {
    to.stream.async_write(asio::buffer(to.outgoing), [&to](error_code error, size_t) {
      // An error is ignored here, because the pending read reports the reason.
      if (error) return;
      {
        const std::lock_guard inner(to.mutex);
        to.sent = true;
      }
      to.changed.notify_all();
    });
  });
  const bool in_time = to.Wait(&lock, deadline, [&] { return to.sent || to.failure; });
  if (in_time && (to.sent || !to.waiting.empty())) return;
  lock.unlock();
  if (!in_time)
    to.Stop(fmt::format("the server did not read a request within {} s", deadline.seconds), Kind::kTimeout);
  throw ServerError(*to.failure);
}

std::optional<Websocket::Message> Websocket::Receive(const Deadline& deadline) {
  Connection& to = *connection_;
  std::unique_lock lock(to.mutex);
  if (!to.Wait(&lock, deadline, [&] { return !to.waiting.empty() || to.failure; })) return std::nullopt;
  if (to.waiting.empty()) throw ServerError(*to.failure);
  return to.Take();
}

std::optional<Websocket::Message> Websocket::ReceiveNow() {
  const std::lock_guard lock(connection_->mutex);
  return connection_->waiting.empty() ? std::nullopt : std::optional(connection_->Take());
}

void Websocket::Abort() { connection_->Stop("closed", Kind::kUnreachable); }

}  // namespace evalbus::policy
