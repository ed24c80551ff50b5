// A server of POST /act like OpenVLA's and OpenVLA-OFT's: one request per connection, JSON in both
// directions.
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
  // Returns the body of the answer to a request with this body.
  using Act = std::function<std::string(const std::string& body)>;

  // Port 0 chooses any free port.
  explicit RestServer(Act act, int port = 0);
  ~RestServer();

  std::string url() const;
  int port() const { return port_; }

  struct Request {
    std::string line;  // "POST /act"
    std::string content_type, authorization, body;
  };
  // All requests so far, oldest first, including unanswered ones.
  std::vector<Request> requests() const;

  // AnswerNextWith() sends exactly these bytes, HTTP or not, in answer to the next request and closes the
  // connection. BeSilentNext() sends no answer to the next request.
  void AnswerNextWith(const std::string& bytes);
  void BeSilentNext();

 private:
  struct Sockets;  // keeps Boost out of this header
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

// The bytes of a complete HTTP response.
std::string HttpAnswer(const std::string& status, const std::string& body);

}  // namespace evalbus::doubles
