#include "viz/web/listener.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "base/errors.h"

namespace evalbus::viz {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

// Size of the kernel's send buffer per connection, bytes.
constexpr int kSendBuffer = 256 << 10;

}  // namespace

void Listener::Listen(const tcp::endpoint& endpoint, const std::string& host) {
  error_code error;
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use) {
    throw InputError(
        fmt::format("port {} is in use; choose another with --port (0: any free port)", endpoint.port()));
  }
  if (error) {
    throw InputError(fmt::format("cannot listen on {} port {}: {}", host, endpoint.port(), error.message()));
  }
  port_ = acceptor_.local_endpoint().port();
}

void Listener::Adopt(int descriptor) {
  error_code error;
  acceptor_.assign(tcp::v4(), descriptor, error);
  if (!error) port_ = acceptor_.local_endpoint(error).port();
  if (error) throw InputError("cannot use the socket to listen on: " + error.message());
}

void Listener::Accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {
      // Accepting may fail, for example if no file descriptor is free. It is retried later.
      pause_.expires_after(std::chrono::milliseconds(100));
      pause_.async_wait([this](error_code stopped) {
        if (!stopped) Accept();
      });
      return;
    }
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    // Called before take_, because the next connections must be accepted even if take_ throws.
    Accept();
    take_(std::move(socket));
  });
}

void Listener::Start(std::function<void(tcp::socket)> take) {
  take_ = std::move(take);
  Accept();
  thread_ = std::thread([this] {
    while (!context_.stopped()) {
      try {
        context_.run();
      } catch (const std::exception& error) {
        // The error (e.g. out of memory) affects only one connection, which has been closed.
        fmt::print(stderr, "warning: {}\n", error.what());
      }
    }
  });
}

void Listener::Stop() {
  context_.stop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace evalbus::viz
