// A client that works while its owner does other things.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

class Conversation {
 public:
  struct Answer {
    Reply reply;
    // Wall-clock time it took.
    double took_s = 0;
  };
  using Job = std::function<Reply(PolicyClient& client)>;

  explicit Conversation(std::unique_ptr<PolicyClient> client) : client_(std::move(client)) {}

  // Called by the thread of each later job when its answer can be taken.
  void SetOnAnswer(std::function<void()> on_answer) { on_answer_ = std::move(on_answer); }

  // Starts a job; the last one has been taken.
  void Start(Job job);
  bool is_busy() const { return answer_.valid(); }
  // What the job answered, once; nothing while it goes on. Throws what the job threw.
  std::optional<Answer> Take();

 private:
  // A job that its owner does not wait for keeps it.
  std::shared_ptr<PolicyClient> client_;
  std::function<void()> on_answer_;
  std::future<Answer> answer_;
};

}  // namespace evalbus::policy
