// Encoding of GR00T's servers (N1.5 to N1.7): MessagePack with text keys. An array is {"__ndarray_class__":
// true, "as_npy": bytes of a .npy file}. A modality configuration is {"__ModalityConfig_class__": true,
// "as_json": JSON text or map} (or "as_dict"), and is decoded to its contents.
#pragma once

#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

Bytes EncodeGroot(const Value& value);

// Decodes exactly one value, with the limits of DecodeMsgpack(). Throws ServerError (kProtocol).
Value DecodeGroot(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
