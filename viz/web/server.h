// The web server of `evalbus web`: HTTP for the page, its blocks and finished episodes, and a WebSocket on
// which each viewer is told what the broadcaster has for it. One thread of its own; nobody waits for it, and
// no viewer for another.
//
// Who may ask. Without an address of the user's choice, at 127.0.0.1: every program of this machine that
// sends a loopback name as Host, so that no other site's page reaches it by DNS rebinding; a WebSocket only
// from a page of this server (Origin). At an address of the user's choice: whoever knows the token, which is
// the first part of the path.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "viz/web/request.h"
#include "viz/web/update_broadcaster.h"

namespace evalbus::viz {

struct WebAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  SharedBytes body{};
  // What it is stands in its name: browsers keep it for good.
  bool is_forever = false;

  static WebAnswer Text(int status, const std::string& text);
};

class WebServer {
 public:
  struct Limits {
    int connections = 512;
    int viewers = 200;
    // Of one connection, from then on so many a second.
    int requests = 1000, requests_per_s = 200;
    int messages = 20, messages_per_s = 5;
    // For the first request of a connection to arrive. While all connections are used, the one that has made
    // no progress for longest is dropped for a new one.
    std::chrono::seconds first_request{5};
    // For later ones, and without progress while a client takes an answer.
    std::chrono::seconds timeout{30};
    // A viewer that neither says nor takes anything, not even the server's pings.
    std::chrono::seconds viewer_timeout{60};
  };
  struct Address {
    // Empty: 127.0.0.1 alone, without a token.
    std::string host{};
    // 0: one that is free.
    uint16_t port = 0;
  };

  using Reply = std::function<void(WebAnswer)>;
  // Answers a target of kind page, file, block or episode; on the server's thread, which it must not hold up:
  // it may call `reply` later and from any thread. Who keeps replies goes before the server does.
  using Handler = std::function<void(const WebTarget& target, Reply reply)>;

  // Listens, in the network that this process is in now, and starts no thread yet. Throws InputError where
  // the address is none of this machine or its port is taken.
  WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster, const Limits& limits);
  WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster);
  // On a socket that listens on the loopback already, inherited from who started this process: descriptor().
  WebServer(int descriptor, std::shared_ptr<UpdateBroadcaster> broadcaster);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  uint16_t port() const;
  int descriptor() const;
  // Empty without an address of the user's choice.
  const std::string& token() const;
  // "http://127.0.0.1:8080/", for people.
  std::string url() const;

  // Serves, until it is stopped or destroyed.
  void Start(Handler handler);
  void Stop();
  // The broadcaster has news.
  void Wake();

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace evalbus::viz
