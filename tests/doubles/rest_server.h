// A server of POST /act as OpenVLA's and OpenVLA-OFT's: one request a connection, JSON there and back.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <vector>

namespace evalbus::doubles {

class RestServer {
 public:
  // The body of an answer to the body of a request.
  using Act = std::function<std::string(const std::string& body)>;

  // Port 0: any that is free.
  explicit RestServer(Act act, int port = 0);
  ~RestServer();

  std::string url() const;
  int port() const { return port_; }

  struct Request {
    std::string line;  // "POST /act"
    std::string content_type, authorization, body;
  };
  // All so far, oldest first, whether answered or not.
  std::vector<Request> requests() const;

  // The next request gets exactly these bytes, HTTP or not, and the end of the connection; or no answer at
  // all.
  void SayNext(const std::string& bytes);
  void BeSilentNext();

 private:
  struct Sockets;  // keeps Boost out of here
  void Serve();

  const Act act_;
  int port_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  struct Fate {
    bool silent;
    std::string bytes;
  };
  std::queue<Fate> fates_;
  std::vector<Request> requests_;
  std::unique_ptr<Sockets> sockets_;
  std::thread thread_;
};

// The bytes of a whole HTTP answer.
std::string HttpAnswer(const std::string& status, const std::string& body);

}  // namespace evalbus::doubles
