// What a server says of itself, held against a contract.
#pragma once

#include <string>
#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

// Lines about what does not fit; none where all does, or the server says nothing. said: what
// PolicyClient::Connect() returned.
std::vector<std::string> FindContradictions(const Contract& contract, const Value& said);

}  // namespace evalbus::policy
