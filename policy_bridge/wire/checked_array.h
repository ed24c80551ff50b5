// Checks that every codec applies to an array before returning it.
#pragma once

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Returns the array with its numbers in little-endian order. Throws ServerError (kProtocol) if no wire
// supports the dtype, or if the number of bytes does not match the shape.
Array CheckedArray(Array array);

}  // namespace evalbus::policy
