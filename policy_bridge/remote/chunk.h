// Extracts the action chunk from a server's answer, as described by the contract.
#pragma once

#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

struct Chunk {
  // num_steps rows of num_values values each.
  std::vector<std::vector<double>> rows;
};

// Concatenates the arrays of contract.action_keys. Each is (H, D), or (D,) for a single step; if there are
// several arrays, one may be (H,), with one value per step. Throws ServerError (kReply), one line with the
// expected and the actual, for missing keys, shapes that contradict contract.actions.num_values or
// chunk_steps, fewer steps than execute_steps, or more than a million values. NaN and infinity are passed on:
// they are faults of the policy, not of the protocol.
Chunk ReadChunk(const Contract& contract, const Value& reply);

}  // namespace evalbus::policy
