// The starts that a policy was trained on, from what its contract names in `trained_on`.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::runner {

class TrainingStarts {
 public:
  // Reads the run folders, suites and exported training sets in contract.trained_on. Throws InputError, with
  // file, line and key of the contract, if one of them is missing, invalid, or does not contain its starts.
  static TrainingStarts Of(const policy::Contract& contract);

  // Whether they contain this start: the same task and variation ("lift_pot/position"), and the same value of
  // each parameter that was drawn. All starts of a variation that draws nothing are equal. parameters: of a
  // line of episodes.jsonl.
  bool Contain(const std::string& task, const nlohmann::ordered_json& parameters) const;

  // For run.json: the sets as the contract names them, the number of different starts in them, and a hash of
  // these starts.
  nlohmann::ordered_json Json() const;

 private:
  std::vector<std::string> sets_;
  std::set<std::string> starts_;
};

}  // namespace evalbus::runner
