// Converts a server's error message to a ServerError.
#pragma once

#include <string>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Returns an error of kind kServer. what() contains the last line of the message, and details() all lines.
ServerError ErrorFromServer(const std::string& words);

}  // namespace evalbus::policy
