// What every codec sees to before it hands out an array.
#pragma once

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// The array with its numbers in little-endian order. Throws ServerError (kProtocol) for a dtype that no wire
// of ours carries, and where there are not exactly as many bytes as the shape says.
Array CheckedArray(Array array);

}  // namespace evalbus::policy
