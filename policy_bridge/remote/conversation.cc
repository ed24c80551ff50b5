#include "policy_bridge/remote/conversation.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace evalbus::policy {
namespace {

// Maximum time for which the destructor of a conversation waits for its client.
constexpr auto kFarewell = std::chrono::seconds(1);

}  // namespace

struct Conversation::Shared {
  std::unique_ptr<PolicyClient> client;
  std::function<void()> on_answer;

  std::mutex mutex;
  std::condition_variable changed;
  Job job;
  std::optional<Answer> answer;
  std::exception_ptr error;
  bool has_thread = false, must_end = false;

  void Work() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return job || must_end; });
      if (must_end) break;
      Job now = std::exchange(job, nullptr);
      lock.unlock();
      Answer answered;
      std::exception_ptr thrown;
      const auto begin = std::chrono::steady_clock::now();
      try {
        answered.reply = now(*client);
        answered.took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      } catch (...) {
        thrown = std::current_exception();
      }
      now = nullptr;
      lock.lock();
      answer = std::move(answered);
      error = thrown;
      if (on_answer && !must_end) on_answer();
    }
    lock.unlock();
    client.reset();
    lock.lock();
    has_thread = false;
    changed.notify_all();
  }
};

Conversation::Conversation(std::unique_ptr<PolicyClient> client) : shared_(std::make_shared<Shared>()) {
  shared_->client = std::move(client);
}

Conversation::~Conversation() {
  std::unique_lock lock(shared_->mutex);
  shared_->must_end = true;
  shared_->changed.notify_all();
  shared_->changed.wait_for(lock, kFarewell, [this] { return !shared_->has_thread; });
}

void Conversation::SetOnAnswer(std::function<void()> on_answer) { shared_->on_answer = std::move(on_answer); }

void Conversation::Start(Job job) {
  is_busy_ = true;
  const std::lock_guard lock(shared_->mutex);
  shared_->job = std::move(job);
  if (!std::exchange(shared_->has_thread, true)) std::thread([shared = shared_] { shared->Work(); }).detach();
  shared_->changed.notify_all();
}

std::optional<Conversation::Answer> Conversation::Take() {
  if (!is_busy_) return std::nullopt;
  const std::lock_guard lock(shared_->mutex);
  if (!shared_->answer) return std::nullopt;
  is_busy_ = false;
  Answer answer = *std::exchange(shared_->answer, std::nullopt);
  if (const auto error = std::exchange(shared_->error, nullptr)) std::rethrow_exception(error);
  return answer;
}

}  // namespace evalbus::policy
