// A task as an environment: the caller chooses each episode and each action. Episodes, observations and
// scores are those of `evalbus run` with a policy of the same contract.
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
  // As accepted by FindContract(); empty: `form` describes observations and actions. Its execute_steps,
  // chunk_steps and first_step_rad do not apply.
  std::string contract;
  ContractForm form;
  // Renderer of the images that are observed; see viz::UseGl.
  std::string gl = viz::kDefaultGl;
};

class Environment {
 public:
  struct Step {
    // As the contract describes it. After the last step of an episode that the physics ended, the observation
    // of the previous step.
    policy::Value observation;
    // {"metrics": ..., "extended": ...} with the values of this tick, as in a line of episodes.jsonl.
    nlohmann::ordered_json scores;
    // The episode's line of episodes.jsonl, if this step ended the episode; null otherwise.
    nlohmann::ordered_json episode;
  };

  // Composes the scene and starts the components in this process. Throws InputError, EnvironmentError.
  explicit Environment(EnvironmentOptions options);
  ~Environment();

  const policy::Contract& contract() const { return contract_; }
  const model_info_t& model() const { return model_; }

  // Starts episode `episode` of a run with this seed, and abandons the current one. Returns the first
  // observation.
  Step Reset(int64_t seed, int episode);
  // Executes one step. `action`: one row, as the contract describes it. Throws InputError if no episode is
  // active or the number of values is wrong.
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
  std::vector<std::string> required_;
  Bus bus_{"memq://"};
  // Outlived by the policy's thread, which holds its shared part.
  StepExchange exchange_;
  ComponentLoop loop_{&bus_};
  std::unique_ptr<Observer> observer_;
  int attempt_ = 0;
  // Tick of the last observation that was returned; -1 before the first one of an episode.
  int64_t tick_ = -1;
  bool is_active_ = false;
  policy::Value observation_;
};

}  // namespace evalbus::runner
