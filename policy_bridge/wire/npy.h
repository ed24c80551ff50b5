// NumPy files (.npy), which GR00T's servers embed in their messages. Format: numpy.lib.format in NumPy's
// documentation, versions 1.0 and 2.0.
#pragma once

#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Writes version 1.0; the numbers start at a multiple of 64 bytes.
Bytes EncodeNpy(const Array& array);

// Throws ServerError (kProtocol) if the bytes are not such a file, and for Fortran order and Python objects.
Array DecodeNpy(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy
