// Encodings of the messages of policy servers.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Checks that every decoder applies to an array before returning it. Returns the array with its numbers in
// little-endian order. Throws ServerError (kProtocol) if no wire supports the dtype, or if the number of
// bytes does not match the shape.
Array CheckedArray(Array array);

// MessagePack (https://github.com/msgpack/msgpack/blob/master/spec.md), with arrays in one of two forms.
// openpi and vla-eval use a map of "__ndarray__": true, "data", "dtype" and "shape". XPolicyLab uses the form
// of the package msgpack-numpy: a map of "nd": true, "type", "kind", "shape" and "data".
//
// Form of an array's keys. kBytes: "__ndarray__" and the other keys as bytes, for openpi's servers. kTexts:
// the same keys as text, for vla-eval's servers. kMsgpackNumpy: the keys of msgpack-numpy as bytes, for
// XPolicyLab's servers.
enum class ArrayKeys { kBytes, kTexts, kMsgpackNumpy };

// Encodes integers as short as possible, and doubles always as float64, as Python's packer does. If a wire
// encodes arrays differently (GR00T), they must be replaced by maps first.
Bytes EncodeMsgpack(const Value& value, ArrayKeys array_keys);

// Decodes one value; trailing bytes are an error. Accepts all array formats, and the NumPy scalars of openpi
// ("__npgeneric__") and msgpack-numpy ("nd": false), with their keys in any order. Converts big-endian arrays
// to little-endian. Replaces an array of strings by a string which states that the array was not read.
// Unsigned numbers that do not fit int64 become doubles.
//
// The bytes are not trusted. Memory use is limited to a fixed multiple of the number of bytes, even if the
// sizes in the input are larger. Throws ServerError (kProtocol) for truncated input, keys that are not
// strings, extensions, and arrays whose data do not match their shape. Also throws it for more than 32
// levels, or more than a million values (numbers in arrays are not counted).
Value DecodeMsgpack(std::span<const uint8_t> bytes);

// JSON in which an array is {"__numpy__": base64 of its bytes, "dtype": "<f4", "shape": [...]}: the format of
// Python's json-numpy package, used by REST policy servers.
//
// Writes keys in the map's order. Throws InputError for a value that JSON cannot represent: bytes, text that
// is not UTF-8, or a number that is not finite.
std::string EncodeJsonNumpy(const Value& value);
// Throws ServerError (kProtocol) for invalid JSON, and for an array whose bytes do not match its shape.
Value DecodeJsonNumpy(std::string_view text);

// Encoding of GR00T's servers (N1.5 to N1.7): MessagePack with string keys. An array is {"__ndarray_class__":
// true, "as_npy": bytes of a .npy file}. A modality configuration is {"__ModalityConfig_class__": true,
// "as_json": JSON text or map}, or the same with "as_dict"; it is decoded to its contents.
Bytes EncodeGroot(const Value& value);
// Decodes exactly one value, with the limits of DecodeMsgpack(). Throws ServerError (kProtocol).
Value DecodeGroot(std::span<const uint8_t> bytes);

// NumPy files (.npy), which GR00T's servers embed in their messages. The format (versions 1.0 and 2.0) is
// described under numpy.lib.format in NumPy's documentation.
//
// Encodes version 1.0 of the format. The numbers start at a multiple of 64 bytes.
Bytes EncodeNpy(const Array& array);
// Throws ServerError (kProtocol) if the bytes are not a .npy file, and if it contains Fortran order or Python
// objects.
Array DecodeNpy(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
