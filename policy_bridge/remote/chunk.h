// The action chunk in a server's answer, as a contract says where it is.
#pragma once

#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

struct Chunk {
  // num_steps rows of num_values each.
  std::vector<std::vector<double>> rows;
};

// The arrays of contract.action_keys side by side: each (H, D), (D,) for one step or, where it is one of
// several, (H,) for one value a step. Throws ServerError (kReply) for missing keys, other shapes than
// contract.actions.num_values or chunk_steps, fewer steps than execute_steps, or more than a million values;
// the line says what was expected and what there is. NaN and infinity are the policy's: they pass.
Chunk ReadChunk(const Contract& contract, const Value& reply);

}  // namespace evalbus::policy
