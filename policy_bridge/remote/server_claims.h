// Compares the description that a server gives of itself with a contract.
#pragma once

#include <string>
#include <vector>

#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

// Returns one line per contradiction. The list is empty if there is none, or if the server does not describe
// itself. metadata: result of PolicyClient::Connect().
std::vector<std::string> FindContradictions(const Contract& contract, const Value& metadata);

}  // namespace evalbus::policy
