// Accepts TCP connections, and runs their handlers in its own thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace evalbus::viz {

class Listener {
 public:
  using tcp = boost::asio::ip::tcp;

  Listener() = default;
  ~Listener() { Stop(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // Listens at an endpoint. Port 0 selects any free port. host: as given by the user, for error messages.
  // Throws InputError if it cannot listen there.
  void Listen(const tcp::endpoint& endpoint, const std::string& host);
  // Uses a socket that already listens. Throws InputError.
  void Adopt(int descriptor);
  uint16_t port() const { return port_; }
  int descriptor() { return acceptor_.native_handle(); }

  // Starts the thread, which calls `take` for each new connection.
  void Start(std::function<void(tcp::socket)> take);
  // After Stop returns, no handler is running.
  void Stop();

  // The I/O context for connections.
  boost::asio::io_context& context() { return context_; }

 private:
  void Accept();

  boost::asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  boost::asio::steady_timer pause_{context_};
  uint16_t port_ = 0;
  std::function<void(tcp::socket)> take_;
  std::thread thread_;
};

}  // namespace evalbus::viz
