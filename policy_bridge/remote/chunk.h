// Extracts the action chunk from a server's answer, as described by the contract.
#pragma once

#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

struct Chunk {
  // One row of num_values values per step.
  std::vector<std::vector<double>> rows;
};

// Concatenates the arrays of contract.action_keys. The shape of an array is (H, D): H steps of D values. An
// array with one axis contains a single step (D,) if it is the only array, and otherwise one value per step
// (H,). Throws ServerError (kReply; one line with the expected and the actual data) for missing keys, arrays
// with different numbers of steps, shapes that contradict contract.actions.num_values or chunk_steps, fewer
// steps than execute_steps, or more than a million values. NaN and infinity are passed on, because they are
// faults of the policy, not of the protocol.
Chunk ReadChunk(const Contract& contract, const Value& reply);

}  // namespace evalbus::policy
