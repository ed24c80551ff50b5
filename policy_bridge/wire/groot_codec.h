// Bytes of GR00T's servers (N1.5 to N1.7): msgpack with keys of text, in which an array is
// {"__ndarray_class__": true, "as_npy": bytes of a .npy file}, and what the server says of a modality
// {"__ModalityConfig_class__": true, "as_json": JSON text or map} (or "as_dict"), read as what is inside.
#pragma once

#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

Bytes EncodeGroot(const Value& value);

// Exactly one value, within DecodeMsgpack's limits. Throws ServerError (kProtocol).
Value DecodeGroot(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
