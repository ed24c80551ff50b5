#include "runner/step_exchange.h"

#include <condition_variable>
#include <mutex>
#include <utility>

namespace evalbus::runner {

struct StepExchange::Shared {
  std::mutex mutex;
  std::condition_variable is_answered;
  bool is_waiting = false, is_abandoned = false;
  std::optional<policy::Value> observation, action;
};

class StepExchange::Client : public policy::PolicyClient {
 public:
  Client(std::shared_ptr<Shared> shared, std::function<void()> on_observation)
      : shared_(std::move(shared)), on_observation_(std::move(on_observation)) {}

  policy::Value Connect() override { return policy::Map(); }
  bool connected() const override { return true; }
  void BeginEpisode(const std::string&, int64_t) override {}
  std::string Name() const override { return "environment"; }

  policy::Reply Infer(const policy::Value& observation) override {
    std::unique_lock lock(shared_->mutex);
    shared_->observation = observation;
    shared_->action.reset();
    shared_->is_abandoned = false;
    shared_->is_waiting = true;
    on_observation_();
    shared_->is_answered.wait(lock, [this] { return shared_->action || shared_->is_abandoned; });
    shared_->is_waiting = false;
    if (shared_->is_abandoned) {
      throw policy::ServerError(policy::ServerError::Kind::kServer, "the episode was abandoned");
    }
    policy::Reply reply;
    reply.value = policy::Map{{"actions", *std::exchange(shared_->action, std::nullopt)}};
    return reply;
  }

 private:
  std::shared_ptr<Shared> shared_;
  std::function<void()> on_observation_;
};

StepExchange::StepExchange() : shared_(std::make_shared<Shared>()) {}

StepExchange::~StepExchange() { Abandon(); }

std::unique_ptr<policy::PolicyClient> StepExchange::MakeClient(std::function<void()> on_observation) {
  return std::make_unique<Client>(shared_, std::move(on_observation));
}

bool StepExchange::is_waiting() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->is_waiting;
}

std::optional<policy::Value> StepExchange::TakeObservation() {
  const std::lock_guard lock(shared_->mutex);
  return std::exchange(shared_->observation, std::nullopt);
}

void StepExchange::Answer(policy::Value action) {
  const std::lock_guard lock(shared_->mutex);
  shared_->action = std::move(action);
  shared_->is_waiting = false;
  shared_->is_answered.notify_all();
}

void StepExchange::Abandon() {
  const std::lock_guard lock(shared_->mutex);
  shared_->is_abandoned = true;
  shared_->is_waiting = false;
  shared_->observation.reset();
  shared_->is_answered.notify_all();
}

}  // namespace evalbus::runner
