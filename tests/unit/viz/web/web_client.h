// The client side of web server tests. Plain sockets send requests that no browser sends; Beast sends normal
// ones.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/deadline.h"

namespace evalbus::viz {

// Sends these bytes and returns what the server at this address answers until it closes the connection, at
// most `most` bytes.
inline std::string AnswerTo(uint16_t port, const std::string& bytes, size_t most = 1 << 20,
                            const std::string& address = "127.0.0.1") {
  namespace asio = boost::asio;
  asio::io_context context;
  boost::beast::tcp_stream stream(context);
  std::string answer(most, '\0');
  size_t count = 0;
  stream.expires_after(kDeadline);
  stream.async_connect({asio::ip::make_address(address), port}, [&](boost::system::error_code error) {
    if (error) return;
    asio::async_write(stream, asio::buffer(bytes), [&](boost::system::error_code, size_t) {
      asio::async_read(stream, asio::buffer(answer), [&](boost::system::error_code, size_t n) { count = n; });
    });
  });
  context.run();
  return answer.substr(0, count);
}

inline std::string Get(uint16_t port, const std::string& target, const std::string& host = "localhost",
                       const std::string& more = "", const std::string& method = "GET",
                       const std::string& address = "127.0.0.1") {
  return AnswerTo(
      port,
      method + " " + target + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" + more + "\r\n",
      1 << 20, address);
}
// Like Get(), for a client that repeatedly reads `part` bytes and then pauses.
inline std::string GetSlowly(uint16_t port, const std::string& target, std::chrono::milliseconds pause,
                             size_t part) {
  namespace asio = boost::asio;
  asio::io_context context;
  asio::ip::tcp::socket socket(context, asio::ip::tcp::v4());
  socket.set_option(asio::socket_base::receive_buffer_size(4096));
  socket.connect({asio::ip::address_v4::loopback(), port});
  asio::write(socket,
              asio::buffer("GET " + target + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"));
  std::string answer, bytes(part, '\0');
  boost::system::error_code error;
  while (!error) {
    answer.append(bytes, 0, asio::read(socket, asio::buffer(bytes), error));
    std::this_thread::sleep_for(pause);
  }
  return answer;
}

// Connections on which half a request was sent. They remain open.
class HalfRequests {
 public:
  explicit HalfRequests(uint16_t port) : port_(port) {}
  void Add() {
    sockets_.emplace_back(context_);
    sockets_.back().connect({boost::asio::ip::address_v4::loopback(), port_});
    boost::asio::write(sockets_.back(), boost::asio::buffer("GET / HTTP/1.1\r\nHost: loc", 25));
  }

 private:
  uint16_t port_;
  boost::asio::io_context context_;
  std::vector<boost::asio::ip::tcp::socket> sockets_;
};
inline int StatusOf(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}
inline std::string BodyOf(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }

// A WebSocket client in place of a page. Each call takes at most kDeadline.
class WebClient {
 public:
  // small_window: requests a small receive buffer, so that the server's sends block soon if the client does
  // not read.
  explicit WebClient(uint16_t port, const std::string& origin = "", const std::string& target = "/live",
                     bool small_window = false) {
    namespace beast = boost::beast;
    namespace websocket = beast::websocket;
    auto& socket = stream_.next_layer().socket();
    socket.open(boost::asio::ip::tcp::v4());
    if (small_window) socket.set_option(boost::asio::socket_base::receive_buffer_size(4096));
    socket.connect({boost::asio::ip::address_v4::loopback(), port}, error_);
    stream_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!origin.empty()) request.set(beast::http::field::origin, origin);
    }));
    stream_.read_message_max(size_t{256} << 20);
    Do([&](auto done) {
      stream_.async_handshake(response_, "localhost:" + std::to_string(port), target, done);
    });
  }

  // Error of the last call; no error if it succeeded.
  const boost::system::error_code& error() const { return error_; }
  int status() const { return static_cast<int>(response_.result_int()); }
  uint16_t close_code() const { return stream_.reason().code; }

  // Returns the next message; empty after an error.
  std::string Read() {
    boost::beast::flat_buffer buffer;
    Do([&](auto done) {
      stream_.async_read(buffer, [done](boost::system::error_code error, size_t) { done(error); });
    });
    return error_ ? "" : boost::beast::buffers_to_string(buffer.data());
  }
  void Publish(const std::string& text) {
    stream_.text(true);
    Do([&](auto done) {
      stream_.async_write(boost::asio::buffer(text),
                          [done](boost::system::error_code error, size_t) { done(error); });
    });
  }

 private:
  template <class Start>
  void Do(const Start& start) {
    if (error_) return;
    stream_.next_layer().expires_after(kDeadline);
    start([this](boost::system::error_code error) { error_ = error; });
    context_.restart();
    context_.run();
  }

  boost::asio::io_context context_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_{context_};
  boost::beast::websocket::response_type response_;
  boost::system::error_code error_;
};

}  // namespace evalbus::viz
