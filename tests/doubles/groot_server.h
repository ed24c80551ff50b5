// A GR00T inference server of any dialect, with a trivial policy behind it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <queue>
#include <string>
#include <thread>
#include <vector>

#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/value.h"

namespace evalbus::doubles {

// The robot has camera "front", states "arm" (any length) and "gripper" (1), and language key
// "annotation.human.task_description". For every observation of a batch, action "arm" (horizon, length) has
// the arm's state + i * step in row i, and action "gripper" (horizon, 1) has i in row i.
class GrootServer {
 public:
  struct Options {
    policy::ClientOptions::GrootDialect dialect = policy::ClientOptions::GrootDialect::kN16;
    int horizon = 3;
    // Encoding of the modality configuration that the server sends.
    enum class Configuration { kJsonText, kMap, kDict, kNone } configuration = Configuration::kMap;
    std::string token;
    int port = 0;  // 0: any free port
    double step = 1;
    // Added to the arm's action for each level of each pixel.
    double per_level = 0;
    // If not zero, the least delay of an answer with actions. The actual delay is twice the time since the
    // last answer, at most kLongestDelay, so that other clients can send meanwhile even on a busy machine.
    std::chrono::milliseconds least_delay{0};
  };
  static constexpr std::chrono::seconds kLongestDelay{1};
  explicit GrootServer(const Options& options);
  ~GrootServer();

  std::string url() const;
  int port() const { return port_; }
  // All requests so far, oldest first, including unanswered ones.
  std::vector<policy::Value> requests() const;

  // Returns the number of observations in each of the requests that asked for actions.
  std::vector<int> batches() const;

  // AnswerNextWith() sends exactly these bytes in answer to the next request to this endpoint. BeSilentNext()
  // sends no answer. BeGoneNext() closes the connection, after which the server no longer listens.
  void AnswerNextWith(const std::string& endpoint, const policy::Bytes& frame);
  void BeSilentNext(const std::string& endpoint);
  void BeGoneNext(const std::string& endpoint);

 private:
  struct Fate {
    enum { kSay, kSilent, kGone } kind;
    policy::Bytes frame;
  };
  struct Sockets;  // keeps ZeroMQ out of this header

  void Serve();
  policy::Value Answer(const policy::Value& request);
  policy::Value Configuration() const;
  policy::Value Act(const policy::Value& data);

  const Options options_;
  int port_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::map<std::string, std::queue<Fate>> fates_;
  std::vector<policy::Value> requests_;
  std::vector<int> batches_;
  std::chrono::steady_clock::time_point last_answer_ = std::chrono::steady_clock::now();
  std::unique_ptr<Sockets> sockets_;
  std::thread thread_;
};

}  // namespace evalbus::doubles
