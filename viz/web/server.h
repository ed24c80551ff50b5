// The web server of `evalbus web`. It serves the page, its blocks and finished episodes over HTTP, and sends
// the broadcaster's updates to each viewer over a WebSocket. It runs in its own thread. No other part of the
// program waits for it, and a slow viewer does not delay others.
//
// Access: By default, the server listens only on 127.0.0.1, and every program on this machine may send
// requests. The Host header must be a loopback name, which prevents DNS rebinding by other sites. A WebSocket
// request that has an Origin header must come from a page of this server. If the user chooses an address,
// clients need the token, which is the first part of the path.
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
  // True if browsers may cache the content permanently, because the URL identifies it.
  bool is_forever = false;

  static WebAnswer Text(int status, const std::string& text);
};

class WebServer {
 public:
  struct Limits {
    int connections = 512;
    int viewers = 200;
    // Limits per connection: size of the initial burst, and rate per second after that.
    int requests = 1000, requests_per_s = 200;
    int messages = 20, messages_per_s = 5;
    // Timeout for the first request of a connection. If all connections are in use, a new connection replaces
    // the connection that has made no progress for the longest time.
    std::chrono::seconds first_request{5};
    // Timeout for later requests, and for a client that does not read its response.
    std::chrono::seconds timeout{30};
    // Timeout for a viewer that sends nothing and reads nothing, not even the server's pings.
    std::chrono::seconds viewer_timeout{60};
  };
  struct Address {
    // Address to listen on. Empty: 127.0.0.1, without a token.
    std::string host{};
    // Port to listen on. 0: any free port.
    uint16_t port = 0;
  };

  using Reply = std::function<void(WebAnswer)>;
  // Answers a target of kind page, file, block or episode. It is called on the server's thread, so it must
  // not block. It may call `reply` later, from any thread. All copies of `reply` must be destroyed before the
  // server.
  using Handler = std::function<void(const WebTarget& target, Reply reply)>;
  // Called on the server's thread with each note that a page sends. Must not block.
  using NoteHandler = std::function<void(WebNote note)>;
  // Called on the server's thread with each verdict of an operator. Must not block.
  using VerdictHandler = std::function<void(WebVerdict verdict)>;

  // Listens in the current network namespace, but does not start a thread yet. Throws InputError if the
  // address does not belong to this machine, or if its port is in use.
  WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster, const Limits& limits);
  WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster);
  // Uses a socket that already listens on the loopback interface, inherited from the parent process (see
  // descriptor()).
  WebServer(int descriptor, std::shared_ptr<UpdateBroadcaster> broadcaster);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  uint16_t port() const;
  int descriptor() const;
  // The access token; empty unless the user chose an address.
  const std::string& token() const;
  // Returns the URL to show to the user, such as "http://127.0.0.1:8080/".
  std::string url() const;

  // Returns whether the server listens on the loopback interface only.
  bool is_loopback() const;

  // Serves until Stop or destruction. If there is no handler for notes or verdicts, viewers that send one are
  // disconnected.
  void Start(Handler handler, NoteHandler on_note = nullptr, VerdictHandler on_verdict = nullptr);
  void Stop();
  // Must be called when the broadcaster has updates.
  void Wake();

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace evalbus::viz
