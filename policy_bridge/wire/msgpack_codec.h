// Values as MessagePack (https://github.com/msgpack/msgpack/blob/master/spec.md), and arrays in it as openpi
// and vla-eval write them: a map of "__ndarray__": true, "data", "dtype" and "shape".
#pragma once

#include <cstdint>
#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// What the four keys of an array are: bytes at openpi's servers, texts at vla-eval's.
enum class ArrayKeys { kBytes, kTexts };

// An int is as short as it can be, a double always a float64, as Python's packer has it. A wire with arrays
// of another form (GR00T) puts maps in their place first.
Bytes EncodeMsgpack(const Value& value, ArrayKeys array_keys);

// One value, and nothing behind it. Takes arrays of both forms and openpi's NumPy scalars
// ("__npgeneric__"), with their keys in any order; numbers of big-endian arrays become little-endian. An
// array of texts becomes a text that says that it was not read. Unsigned numbers that int64 does not hold
// become doubles.
//
// Bytes may be anything: allocates no more than a fixed multiple of what they hold, whatever they announce.
// Throws ServerError kProtocol for what is cut short, has keys that are no texts, extensions or more than 32
// levels, more than a million values (the numbers of an array are none), or arrays whose data do not fit.
Value DecodeMsgpack(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
