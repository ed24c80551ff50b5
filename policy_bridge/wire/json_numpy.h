// JSON in which an array is {"__numpy__": base64 of its bytes, "dtype": "<f4", "shape": [...]}: the format of
// Python's json-numpy package, used by REST policy servers.
#pragma once

#include <string>
#include <string_view>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Writes keys in the map's order. Throws InputError for a value that JSON cannot represent: bytes, text that
// is not UTF-8, or a number that is not finite.
std::string EncodeJsonNumpy(const Value& value);

// Decodes JSON text. Throws ServerError (kProtocol) for invalid JSON, and for an array whose bytes do not
// match its shape.
Value DecodeJsonNumpy(std::string_view text);

}  // namespace evalbus::policy
