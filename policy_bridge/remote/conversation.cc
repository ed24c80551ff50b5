#include "policy_bridge/remote/conversation.h"

#include <chrono>
#include <thread>

namespace evalbus::policy {

void Conversation::Start(Job job) {
  std::packaged_task<Answer()> task([client = client_, job = std::move(job)] {
    const auto begin = std::chrono::steady_clock::now();
    Reply reply = job(*client);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    return Answer{std::move(reply), took.count()};
  });
  answer_ = task.get_future();
  // Nobody joins it: a process that is told to stop does not wait for a server's answer.
  std::thread([task = std::move(task), on_answer = on_answer_]() mutable {
    task();
    if (on_answer) on_answer();
  }).detach();
}

std::optional<Conversation::Answer> Conversation::Take() {
  if (!answer_.valid() || answer_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  return answer_.get();
}

}  // namespace evalbus::policy
