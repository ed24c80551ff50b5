// Hands a policy's observations to the caller of an environment, and the caller's actions to the policy.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::runner {

// Thread-safe: the policy's side runs in the thread of its conversation.
class StepExchange {
 public:
  StepExchange();
  ~StepExchange();
  StepExchange(const StepExchange&) = delete;
  StepExchange& operator=(const StepExchange&) = delete;

  // Client of a policy whose server is the caller. on_observation: called from the policy's thread. The
  // client may outlive this object.
  std::unique_ptr<policy::PolicyClient> MakeClient(std::function<void()> on_observation);

  // Whether an observation waits for its action.
  bool is_waiting() const;
  // The observation that waits for its action; can be taken once.
  std::optional<policy::Value> TakeObservation();
  // Answers the waiting observation. Must only be called while is_waiting().
  void Answer(policy::Value action);
  // Lets the policy fail at the waiting observation, if there is one.
  void Abandon();

 private:
  struct Shared;
  class Client;

  std::shared_ptr<Shared> shared_;
};

}  // namespace evalbus::runner
