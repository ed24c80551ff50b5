// A policy server as others write them (openpi, RoboArena's dialect, vla-eval), on 127.0.0.1 and on a thread
// of its own. It answers as a test says, also wrongly.
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
  // What it does where an answer is due. A Value is sent as the wire has it; vla-eval's envelope is put
  // around it.
  struct Nothing {};
  struct Text {
    std::string text;
  };
  // As the wire says that something failed: openpi's text and close 1011, vla-eval's error message.
  struct Error {
    std::string text;
  };
  // A binary message of any bytes.
  struct Message {
    Bytes bytes;
  };
  // Bytes on the connection without a frame; then, perhaps, its end.
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
  // Five bytes announced, of which one comes.
  static Raw HalfFrame() { return {{0x82, 5, 0x81}, true}; }
  static Raw Announced2GB() { return {{0x82, 127, 0, 0, 0, 0, 0x80, 0, 0, 0}, false}; }

  struct Options {
    Wire wire = Wire::kOpenpi;  // kRoboArena, kVlaEval
    // What openpi and RoboArena begin with, what vla-eval answers a hello with ("protocol_version" is added).
    Answer greeting = Value(Map{});
    // To an observation, without RoboArena's endpoint and vla-eval's envelope. Runs on the server's thread,
    // which does nothing else meanwhile, as openpi's.
    std::function<Answer(const Value& observation)> answer;
    Answer reset = Text{"reset successful"};  // RoboArena's
    Answer episode_start = Nothing{};         // vla-eval's, whose servers say nothing but errors
    // Another one: refuses to become a websocket with it; 0: answers with what is no HTTP; -1: not at all.
    int http_status = 101;
    // Whether Requests() has them; a benchmark sends too many.
    bool keeps_requests = true;
  };

  // As the client's HTTP request had them; empty where it had none.
  struct Handshake {
    std::string host, target, authorization, extensions;
  };

  explicit PolicyServerDouble(Options options);
  ~PolicyServerDouble();

  // At the same port again.
  void Start();
  // With all connections, without a word.
  void Stop();

  int port() const { return port_; }
  std::string url() const { return "ws://127.0.0.1:" + std::to_string(port_); }

  // All messages so far, as they came.
  std::vector<Value> Requests() const;
  std::vector<Handshake> Handshakes() const;

  // Connections that the client ended with a word.
  size_t Goodbyes() const;

  // Pings all connections, and waits for an answer of each. False if one does not come in time; then drops
  // them all, as websockets' keep-alive does.
  bool Ping(std::chrono::seconds limit = kDeadline);
  // A message to all connections that wait for a request.
  void SayUnasked(const std::string& message, bool is_text);
  // Waits until so many connections are open.
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
