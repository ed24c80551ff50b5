// Provides a task as an environment, in which the caller chooses each episode and each action. Episodes,
// observations and scores are the same as in `evalbus run` with a policy that has the same contract.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/scratch.h"
#include "bus/bus.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "policy_bridge/contract/contract.h"
#include "runner/component_loop.h"
#include "runner/environment_contract.h"
#include "runner/step_exchange.h"
#include "sim/prepared_scene.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::runner {

struct EnvironmentOptions {
  sim::SimOptions sim;
  // Name or file of a contract, as accepted by FindContract(). If empty, `form` describes observations and
  // actions. The contract's execute_steps, chunk_steps and first_step_rad are ignored.
  std::string contract;
  ContractForm form;
  // Renderer of the observed images; see viz::UseGl.
  std::string gl = viz::kDefaultGl;
};

class Environment {
 public:
  struct Step {
    // Observation as described by the contract. The last step repeats the previous observation if the sim
    // stopped without publishing another state, or if the episode ended while the robot settled.
    policy::Value observation;
    // Values of this tick as {"metrics": ..., "extended": ...}, as in a line of episodes.jsonl.
    nlohmann::ordered_json scores;
    // The episode's line for episodes.jsonl if this step ended the episode; null otherwise.
    nlohmann::ordered_json episode;
  };

  // Composes the scene and starts the components in this process. Throws InputError or EnvironmentError.
  explicit Environment(EnvironmentOptions options);
  ~Environment();

  const policy::Contract& contract() const { return contract_; }
  const model_info_t& model() const { return model_; }
  // A sentence about the control rate if it is not the requested one; otherwise empty.
  const std::string& changed_rate() const { return changed_rate_; }

  // Starts episode `episode` of a run with this seed, and abandons the current one. Returns the first
  // observation.
  Step Reset(int64_t seed, int episode);
  // Executes one step. `action`: the values of one action, as described by the contract. Throws InputError if
  // no episode is active or the number of values is wrong, and EnvironmentError if the episode is aborted.
  Step Act(const policy::Array& action);

 private:
  class Observer;

  void Advance();
  // Waits until the tick is scored and its observation is available, or the episode has ended.
  Step WaitForTick(int64_t tick);
  bool IsFinal() const;

  const Scratch folder_;
  sim::SimOptions sim_;
  policy::Contract contract_;
  model_info_t model_{};
  std::string changed_rate_;
  std::vector<std::string> required_;
  Bus bus_{"memq://"};
  // The policy's thread may outlive this member, because it co-owns the shared state.
  StepExchange exchange_;
  ComponentLoop loop_{&bus_};
  std::unique_ptr<Observer> observer_;
  int attempt_ = 0;
  // Tick of the last observation that was returned; -1 before the first observation of an episode.
  int64_t tick_ = -1;
  bool is_active_ = false;
  policy::Value observation_;
};

}  // namespace evalbus::runner
