// A client that works on a thread of its own, one job at a time.
#pragma once

#include <functional>
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

  explicit Conversation(std::unique_ptr<PolicyClient> client);
  // Does not wait for a job that is not done: a process that is to stop does not wait for a server's answer.
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  // Called by the thread when an answer can be taken. Must be set before the first job.
  void SetOnAnswer(std::function<void()> on_answer);

  // Starts a job. Must not be called while is_busy().
  void Start(Job job);
  // A job was started, and its answer was not taken.
  bool is_busy() const { return is_busy_; }
  // What the job answered, once; nothing while it is at work. Throws what the job threw.
  std::optional<Answer> Take();

 private:
  struct Shared;

  // The thread keeps it as long as it works.
  std::shared_ptr<Shared> shared_;
  bool is_busy_ = false;
};

}  // namespace evalbus::policy
