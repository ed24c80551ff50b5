// A policy server that behaves like third-party servers (openpi, RoboArena's dialect, vla-eval, XPolicyLab).
// It runs on 127.0.0.1 in a separate thread. A test chooses its answers, including wrong ones.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/value.h"
#include "tests/deadline.h"

namespace evalbus::policy {

class PolicyServerDouble {
 public:
  // What the server does when an answer is due. A Value is encoded as the wire protocol demands, in the
  // envelope of vla-eval or XPolicyLab if the wire is one of these.
  struct Nothing {};
  struct Text {
    std::string text;
  };
  // A failure as the wire protocol reports it: openpi's text and close code 1011, or vla-eval's or
  // XPolicyLab's error message.
  struct Error {
    std::string text;
    std::string code = "infer_failed";  // XPolicyLab only
  };
  // A binary message of arbitrary bytes.
  struct Message {
    Bytes bytes;
  };
  // Bytes on the connection outside any frame; optionally, the connection is then closed.
  struct Raw {
    Bytes bytes;
    bool then_gone = false;
  };
  struct Close {
    uint16_t code = 1001;
    std::string reason;
  };
  using Answer = std::variant<Value, Nothing, Text, Error, Message, Raw, Close>;

  static Raw Gone() { return {{}, true}; }
  // A frame that announces five bytes and contains one.
  static Raw HalfFrame() { return {{0x82, 5, 0x81}, true}; }
  static Raw Announced2GB() { return {{0x82, 127, 0, 0, 0, 0, 0x80, 0, 0, 0}, false}; }

  struct Options {
    Wire wire = Wire::kOpenpi;  // or kRoboArena, kVlaEval, kXPolicyLab
    // openpi and RoboArena: first message to each client. vla-eval and XPolicyLab: answer to the client's
    // hello; for vla-eval, "protocol_version" is added.
    Answer greeting = Value(Map{});
    // Answer to an observation, without RoboArena's endpoint and without the envelope of vla-eval and
    // XPolicyLab. The function runs on the server's thread and blocks it, as in openpi.
    std::function<Answer(const Value& observation)> answer;
    Answer reset = Text{"reset successful"};  // RoboArena only
    Answer episode_start = Nothing{};         // vla-eval only; its servers answer only on errors
    // XPolicyLab only: answer to prepare_case, reset and trial_end.
    std::function<Answer(const std::string& type)> control = [](const std::string&) {
      return Value(Map{{"ok", true}});
    };
    // 101 accepts the WebSocket upgrade; any other status refuses it. 0 answers with bytes that are not HTTP;
    // -1 does not answer.
    int http_status = 101;
    // True if Requests() keeps the requests. A benchmark sets this to false, because it sends too many.
    bool keeps_requests = true;
  };

  // Fields of the client's HTTP request; a field that was not sent is empty.
  struct Handshake {
    std::string host, target, authorization, extensions;
  };

  explicit PolicyServerDouble(Options options);
  ~PolicyServerDouble();

  // Starts the server. A restart after Stop() uses the same port.
  void Start();
  // Stops the server and closes all connections without a close frame.
  void Stop();

  int port() const { return port_; }
  std::string url() const { return "ws://127.0.0.1:" + std::to_string(port_); }

  // All messages so far, in the order received.
  std::vector<Value> Requests() const;
  std::vector<Handshake> Handshakes() const;

  // Returns the number of connections that the client ended with a close frame.
  size_t Goodbyes() const;

  // Pings all connections and waits for their answers. If one answer does not arrive in time, drops all
  // connections, as the keep-alive of Python's websockets does, and returns false.
  bool Ping(std::chrono::seconds limit = kDeadline);
  // Sends a message to all connections that wait for a request.
  void SendUnrequested(const std::string& message, bool is_text);
  // Waits until `count` connections are open.
  bool WaitForConnections(size_t count, std::chrono::seconds limit = kDeadline);

 private:
  struct Server;
  struct Session;
  struct Seen;

  const Options options_;
  const std::unique_ptr<Seen> seen_;
  int port_ = 0;
  std::unique_ptr<Server> server_;
};

}  // namespace evalbus::policy
