// The outer half of a server of TCP: takes connections and works on them, in a thread of its own.
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

  // Port 0: any that is free. host: as the user named it. Throws InputError where it cannot be.
  void Listen(const tcp::endpoint& endpoint, const std::string& host);
  // A socket that listens already. Throws InputError.
  void Adopt(int descriptor);
  uint16_t port() const { return port_; }
  int descriptor() { return acceptor_.native_handle(); }

  // From now on each connection is taken on the thread.
  void Start(std::function<void(tcp::socket)> take);
  // No handler runs any more.
  void Stop();

  // What connections work with.
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
