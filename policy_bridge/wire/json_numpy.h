// JSON in which an array is {"__numpy__": base64 of its bytes, "dtype": "<f4", "shape": [...]}: what the
// json-numpy package of Python makes of arrays, and REST policy servers speak.
#pragma once

#include <string>
#include <string_view>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Keys in the map's order. Throws InputError for what JSON has no place for: bytes, text that is no UTF-8, a
// number that is not finite.
std::string EncodeJsonNumpy(const Value& value);

// Throws ServerError (kProtocol) for what is no JSON, and for an array whose bytes do not fit.
Value DecodeJsonNumpy(std::string_view text);

}  // namespace evalbus::policy
