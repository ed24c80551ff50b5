#include "tests/doubles/rest_server.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>

namespace evalbus::doubles {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;

struct RestServer::Sockets {
  explicit Sockets(int port)
      : acceptor(io, {asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(port)}) {}
  asio::io_context io;
  tcp::acceptor acceptor;
};

RestServer::RestServer(Act act, int port) : act_(std::move(act)), sockets_(std::make_unique<Sockets>(port)) {
  port_ = sockets_->acceptor.local_endpoint().port();
  thread_ = std::thread([this] { Serve(); });
}

RestServer::~RestServer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  // Connects to the server to end a pending accept.
  asio::io_context io;
  tcp::socket socket(io);
  error_code ignored;
  socket.connect({asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(port_)}, ignored);
  thread_.join();
}

std::string RestServer::url() const { return fmt::format("http://127.0.0.1:{}/act", port_); }

std::vector<RestServer::Request> RestServer::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

void RestServer::AnswerNextWith(const std::string& bytes) {
  const std::lock_guard lock(mutex_);
  fates_.push({false, bytes});
}

void RestServer::BeSilentNext() {
  const std::lock_guard lock(mutex_);
  fates_.push({true, {}});
}

void RestServer::Serve() {
  while (true) {
    tcp::socket socket(sockets_->io);
    error_code error;
    sockets_->acceptor.accept(socket, error);
    std::unique_lock lock(mutex_);
    if (stopping_) return;
    lock.unlock();
    boost::beast::flat_buffer buffer;
    http::request_parser<http::string_body> parser;
    parser.body_limit(uint64_t{1} << 40);
    http::read(socket, buffer, parser, error);
    if (error) continue;  // a client that only checked whether the port is open
    const http::request<http::string_body> request = parser.release();
    lock.lock();
    requests_.push_back(
        {fmt::format("{} {}", std::string(request.method_string()), std::string(request.target())),
         std::string(request[http::field::content_type]), std::string(request[http::field::authorization]),
         request.body()});
    std::optional<Fate> fate;
    if (!fates_.empty()) {
      fate = fates_.front();
      fates_.pop();
    }
    if (fate && fate->silent) {
      stop_.wait(lock, [&] { return stopping_; });
      return;
    }
    lock.unlock();
    const std::string answer = fate ? fate->bytes : HttpAnswer("200 OK", act_(request.body()));
    asio::write(socket, asio::buffer(answer), error);
    socket.shutdown(tcp::socket::shutdown_both, error);
  }
}

std::string HttpAnswer(const std::string& status, const std::string& body) {
  return fmt::format("HTTP/1.1 {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{}", status,
                     body.size(), body);
}

}  // namespace evalbus::doubles
