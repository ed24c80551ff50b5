// What a server says of its failure, as an error of ours.
#pragma once

#include <string>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// kServer; what() has the last line of its words, details() has all of them.
ServerError ServerSays(const std::string& words);

}  // namespace evalbus::policy
