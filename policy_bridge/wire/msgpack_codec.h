// Values as MessagePack (https://github.com/msgpack/msgpack/blob/master/spec.md), with arrays in one of two
// forms. openpi and vla-eval use a map of "__ndarray__": true, "data", "dtype" and "shape". XPolicyLab uses
// the form of the package msgpack-numpy: a map of "nd": true, "type", "kind", "shape" and "data".
#pragma once

#include <cstdint>
#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Form of an array's keys. kBytes: "__ndarray__" and the other keys as bytes, for openpi's servers. kTexts:
// the same keys as text, for vla-eval's servers. kMsgpackNumpy: the keys of msgpack-numpy as bytes, for
// XPolicyLab's servers.
enum class ArrayKeys { kBytes, kTexts, kMsgpackNumpy };

// Encodes integers as short as possible, and doubles always as float64, as Python's packer does. If a wire
// has another form of arrays (GR00T), they must be replaced by maps first.
Bytes EncodeMsgpack(const Value& value, ArrayKeys array_keys);

// Decodes one value; trailing bytes are an error. Accepts arrays of all forms and NumPy scalars of openpi
// ("__npgeneric__") and msgpack-numpy ("nd": false), with their keys in any order. Converts numbers of
// big-endian arrays to little-endian. Replaces an array of texts by a text which states that the array was
// not read. Unsigned numbers that do not fit int64 become doubles.
//
// The bytes are not trusted. Memory use is limited to a fixed multiple of the number of bytes, whatever sizes
// the bytes announce. Throws ServerError (kProtocol) for truncated input, keys that are not texts,
// extensions, and arrays whose data do not match their shape. Also throws it for more than 32 levels, or more
// than a million values (numbers in arrays are not counted).
Value DecodeMsgpack(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
