// The starts on which a policy was trained, from the training sets in its contract's `trained_on`.
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

  // Returns whether this start was used for training. Starts are equal if task, variation
  // ("lift_pot/position") and the values of all drawn parameters are equal, so all starts of a variation that
  // draws nothing are equal. parameters: value of "parameters" in a line of episodes.jsonl.
  bool Contain(const std::string& task, const nlohmann::ordered_json& parameters) const;

  // Returns the value for run.json: the sets as the contract names them, the number of different starts in
  // them, and a hash of these starts.
  nlohmann::ordered_json Json() const;

 private:
  std::vector<std::string> sets_;
  std::set<std::string> starts_;
};

}  // namespace evalbus::runner
