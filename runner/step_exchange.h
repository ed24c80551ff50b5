// Passes a policy's observations to the caller of an environment, and the caller's actions to the policy.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::runner {

// Thread-safe, because the policy's side runs on its own thread.
class StepExchange {
 public:
  StepExchange();
  ~StepExchange();
  StepExchange(const StepExchange&) = delete;
  StepExchange& operator=(const StepExchange&) = delete;

  // Returns a policy client whose server is the caller of the environment. on_observation: called on the
  // policy's thread. The client may outlive this object.
  std::unique_ptr<policy::PolicyClient> MakeClient(std::function<void()> on_observation);

  // Returns true if an observation waits for its action.
  bool is_waiting() const;
  // Returns the observation that waits for its action; nullopt if it was already taken or does not exist.
  std::optional<policy::Value> TakeObservation();
  // Answers the waiting observation. Must only be called while is_waiting().
  void Answer(policy::Value action);
  // Makes the policy fail at the waiting observation, if there is one.
  void Abandon();

 private:
  struct Shared;
  class Client;

  std::shared_ptr<Shared> shared_;
};

}  // namespace evalbus::runner
