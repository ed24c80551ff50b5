// Runs the calls of a policy client on a separate thread, one job at a time.
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
    // Wall-clock duration of the job.
    double took_s = 0;
  };
  using Job = std::function<Reply(PolicyClient& client)>;

  explicit Conversation(std::unique_ptr<PolicyClient> client);
  // Destroys the client, which may notify its server of the end. Waits at most 1 s for this and for an
  // unfinished job, so that a process can stop even if the server does not answer.
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  // Sets the function that the thread calls when an answer is available. Must be called before the first job.
  void SetOnAnswer(std::function<void()> on_answer);

  // Starts a job. Must not be called while is_busy().
  void Start(Job job);
  // Returns whether a job has been started and its answer has not been taken yet.
  bool is_busy() const { return is_busy_; }
  // Returns the answer of a finished job, once. Returns nullopt while the job is running. Rethrows an
  // exception of the job.
  std::optional<Answer> Take();

 private:
  struct Shared;

  // Data shared with the thread, which may outlive this object.
  std::shared_ptr<Shared> shared_;
  bool is_busy_ = false;
};

}  // namespace evalbus::policy
